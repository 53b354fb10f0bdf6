// A locusd of the benchmark's own: on a free port of the loopback, with a client of the library to fill it. For every
// case. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_DAEMON_H_
#define LOCUS_TESTS_BENCH_SERVING_DAEMON_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/lib/client.h"
#include "grpcpp/channel.h"
#include "tests/bench/serving/process.h"

namespace locus::bench::serving {

class Daemon {
 public:
  // `options` of locusd beside the ones for its port. UNAVAILABLE, with what it printed, if it does not serve in time.
  static absl::StatusOr<std::unique_ptr<Daemon>> start(const std::vector<std::string>& options = {});

  const std::string& address() const { return address_; }
  const client::Client& client() const { return *client_; }
  const Process& process() const { return *process_; }

  // A channel with a connection of its own.
  std::shared_ptr<grpc::Channel> channel() const;

 private:
  Daemon() = default;

  TemporaryFolder folder_;
  std::unique_ptr<Process> process_;  // ends before its folder does
  std::string address_;
  std::unique_ptr<client::Client> client_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_DAEMON_H_
