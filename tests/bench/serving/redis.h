// A Redis server that a benchmark starts, in memory and on a socket in a temporary folder; and the part of its protocol
// that the cases need. Messages are serialized beforehand and replies are only counted, so that the client costs almost
// nothing. The destructor stops the server. One thread.
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
  // Starts Redis. Returns UNAVAILABLE if it is not installed, or does not answer in time.
  static absl::StatusOr<std::unique_ptr<Redis>> start();

  // Sends all messages `passes` times, with up to `window` in flight. An error of Redis is stored in status().
  void run(const std::vector<std::string>& messages, size_t passes, size_t window);
  // Returns a sum over all replies of the last run(). A list reply adds its number of members, an integer reply its
  // value.
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

// Returns a command in Redis's format: a list of strings.
std::string redis_command(const std::vector<std::string>& words);

// Returns the length of the first complete reply in `received`; 0 if there is none.
size_t redis_reply_bytes(absl::string_view received);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_REDIS_H_
