// A locusd that the benchmark starts, and a client (of the client library) with which the cases fill it. Used by every
// case. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_DAEMON_H_
#define LOCUS_TESTS_BENCH_SERVING_DAEMON_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/lib/client.h"
#include "tests/bench/serving/local_server.h"

namespace locus::bench::serving {

// Option of locusd for cases with many new connections, all of which come from one address.
inline constexpr const char* kManyNewConnections = "--max-new-connections=100000";

class Daemon final : public LocalServer {
 public:
  // Starts locusd with `options`, and options for its port; connections to it use `credentials`. Returns UNAVAILABLE,
  // with the output of locusd, if it does not serve in time.
  static absl::StatusOr<std::unique_ptr<Daemon>> start(const std::vector<std::string>& options = {},
                                                       const client::CredentialOptions& credentials = {});

  const client::Client& client() const { return *client_; }

 private:
  Daemon() = default;

  std::unique_ptr<client::Client> client_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_DAEMON_H_
