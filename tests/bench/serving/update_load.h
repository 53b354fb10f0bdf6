// Batches of updates that are sent repeatedly over one stream, in order. Used by every case that counts moves per
// second. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_UPDATE_LOAD_H_
#define LOCUS_TESTS_BENCH_SERVING_UPDATE_LOAD_H_

#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "locus/v1/update_service.grpc.pb.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/stream_load.h"

namespace locus::bench::serving {

class UpdateLoad {
 public:
  // Expected kind of every ack: ack of a batch that was applied without refusals, or of a duplicate.
  enum class Expect : uint8_t { kApplied, kDuplicate };

  // Borrows the messages.
  UpdateLoad(const Daemon& daemon, std::vector<v1::StreamUpdatesRequest>& messages, size_t window, Expect expect);

  // Sends all messages `passes` times. Errors are stored in status().
  void run(size_t passes);
  const absl::Status& status() const { return status_; }
  // Returns the serialized size of the last ack in bytes.
  size_t ack_bytes() const { return ack_bytes_; }

 private:
  using Load = StreamLoad<v1::StreamUpdatesRequest, v1::StreamUpdatesResponse>;

  std::vector<v1::StreamUpdatesRequest>& messages_;
  const size_t window_;
  const Expect expect_;
  std::unique_ptr<Load> stream_;
  size_t ack_bytes_ = 0;
  absl::Status status_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_UPDATE_LOAD_H_
