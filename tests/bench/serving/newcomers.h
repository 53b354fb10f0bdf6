// Clients that connect, send one unary query, and disconnect when it is answered; a few at the same time, each on a
// thread of its own. Used by the cases that measure new connections. One thread at a time.
#ifndef LOCUS_TESTS_BENCH_SERVING_NEWCOMERS_H_
#define LOCUS_TESTS_BENCH_SERVING_NEWCOMERS_H_

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/query_load.h"

namespace locus::bench::serving {

class Newcomers {
 public:
  // Client number i sends the batch with index i modulo the number of batches. Borrows the daemon.
  Newcomers(const Daemon& daemon, const Batches& batches);

  // Runs `count` clients. Errors are stored in status().
  void run(size_t count);
  // Sends every batch by a client of its own; returns a hash of each answer, in the order of the batches.
  std::vector<uint64_t> hashes();

  const absl::Status& status() const { return status_; }

 private:
  absl::Status come(size_t batch, uint64_t* hash) const;

  const Daemon& daemon_;
  std::vector<v1::QueryRequest> requests_;
  absl::Status status_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_NEWCOMERS_H_
