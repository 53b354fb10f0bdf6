// Repeated batches of queries: answered by a server, over streams with a connection each, or by threads of this
// process. Used by every case that counts queries per second. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_QUERY_LOAD_H_
#define LOCUS_TESTS_BENCH_SERVING_QUERY_LOAD_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "tests/bench/serving/stream_load.h"
#include "tests/bench/serving/twin_scene.h"

namespace locus::bench::serving {

using QueryStreamLoad = StreamLoad<v1::StreamQueriesRequest, v1::StreamQueriesResponse>;
std::unique_ptr<QueryStreamLoad> open_query_streams(const LocalServer& server, size_t streams);

// Messages for a server, and the same batches as columns for this process. The messages are divided among streams, and
// the columns among threads.
struct Batches {
  std::vector<v1::StreamQueriesRequest> messages;
  std::vector<QueryBatch> columns;  // borrow the values of `messages`
  size_t queries = 0;               // number of queries in all messages together

  // Sets `columns`. Call it when all messages have been added, since `columns` borrows from them.
  void borrow();
};

class ServerLoad {
 public:
  ServerLoad(const LocalServer& server, Batches& batches, size_t streams, size_t window);

  // Sends `passes` times as many messages as there are batches, divided among the streams. Each stream repeats its part
  // of the batches. Errors are stored in status().
  void run(size_t passes);
  // Sends every batch once; returns a hash of each answer, in the order of the batches, and sets rows() to the number
  // of rows in all answers.
  std::vector<uint64_t> hashes();
  size_t rows() const { return rows_; }

  const absl::Status& status() const { return status_; }

 private:
  Batches& batches_;
  const size_t count_;
  const std::unique_ptr<QueryStreamLoad> streams_;
  const size_t window_;
  size_t rows_ = 0;
  absl::Status status_;
};

class LocalLoad {
 public:
  LocalLoad(SnapshotPtr snapshot, const Batches& batches, size_t threads);

  void run(size_t passes) const;
  std::vector<uint64_t> hashes() const;

 private:
  const SnapshotPtr snapshot_;
  const Batches& batches_;
  const size_t threads_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_QUERY_LOAD_H_
