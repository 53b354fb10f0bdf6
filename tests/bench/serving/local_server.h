// A program in the folder of this one that serves gRPC on a free port of the loopback, and connections to it. For the
// daemon and for the echo server. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_LOCAL_SERVER_H_
#define LOCUS_TESTS_BENCH_SERVING_LOCAL_SERVER_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "grpcpp/channel.h"
#include "tests/bench/frame/temporary_folder.h"
#include "tests/bench/serving/process.h"

namespace locus::bench::serving {

// Returns a channel with a connection of its own.
std::shared_ptr<grpc::Channel> connection_to(const std::string& address);

class LocalServer {
 public:
  // Runs the program of that name, which takes locusd's options for its port. UNAVAILABLE, with its output, if it does
  // not serve in time.
  static absl::StatusOr<std::unique_ptr<LocalServer>> start(const std::string& program);
  virtual ~LocalServer() = default;
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  const std::string& address() const { return address_; }
  const Process& process() const { return *process_; }
  // Returns the output up to now.
  std::string log() const;

  std::shared_ptr<grpc::Channel> channel() const { return connection_to(address_); }

 protected:
  LocalServer() = default;
  // Runs the program, once. Adds `options` to those for the port.
  absl::Status run(const std::string& program, const std::vector<std::string>& options);

 private:
  TemporaryFolder folder_;
  std::unique_ptr<Process> process_;  // destroyed before its folder
  std::string address_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_LOCAL_SERVER_H_
