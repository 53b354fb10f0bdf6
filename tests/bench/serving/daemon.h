// A locusd started by the benchmark, with a client of the library to fill it. For every case. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_DAEMON_H_
#define LOCUS_TESTS_BENCH_SERVING_DAEMON_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/lib/client.h"
#include "tests/bench/serving/local_server.h"

namespace locus::bench::serving {

class Daemon final : public LocalServer {
 public:
  // Starts locusd with `options` beside those for its port. UNAVAILABLE, with its output, if it does not serve in time.
  static absl::StatusOr<std::unique_ptr<Daemon>> start(const std::vector<std::string>& options = {});

  const client::Client& client() const { return *client_; }

 private:
  Daemon() = default;

  std::unique_ptr<client::Client> client_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_DAEMON_H_
