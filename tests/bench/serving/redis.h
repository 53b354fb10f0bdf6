// Redis as a benchmark starts it for itself: in memory, on a socket in a folder of its own, ended with this object; and
// the few words of its protocol that are needed. Messages are written ahead and replies only counted, so that its
// client takes nothing that is not Redis's. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_REDIS_H_
#define LOCUS_TESTS_BENCH_SERVING_REDIS_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "tests/bench/frame/temporary_folder.h"
#include "tests/bench/serving/process.h"
#include "tests/bench/serving/socket_load.h"

namespace locus::bench::serving {

class Redis {
 public:
  // UNAVAILABLE where it is not installed, or does not answer in time.
  static absl::StatusOr<std::unique_ptr<Redis>> start();

  // Sends all messages, `passes` times, so many at once under way. An error of Redis shows in status().
  void run(const std::vector<std::string>& messages, size_t passes, size_t window);
  // The members of every list that was answered, or the numbers, together; of the last run.
  size_t counted() const { return counted_; }
  const absl::Status& status() const { return status_; }

 private:
  Redis() = default;

  TemporaryFolder folder_;
  std::unique_ptr<Process> process_;
  std::unique_ptr<SocketLoad> connection_;
  size_t counted_ = 0;
  absl::Status status_;
};

// A command as Redis reads it: a list of strings.
std::string redis_command(const std::vector<std::string>& words);

// Bytes of the first whole reply in what came; 0 while there is none.
size_t redis_reply_bytes(absl::string_view received);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_REDIS_H_
