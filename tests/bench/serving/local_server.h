// Starts a program that is in the folder of this program and serves gRPC on a free port of the loopback; and makes
// connections to it. Used for the daemon (class Daemon) and for the echo server. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_LOCAL_SERVER_H_
#define LOCUS_TESTS_BENCH_SERVING_LOCAL_SERVER_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "grpcpp/channel.h"
#include "grpcpp/security/credentials.h"
#include "tests/bench/frame/temporary_folder.h"
#include "tests/bench/serving/process.h"

namespace locus::bench::serving {

// Returns a channel to `address` that shares its connection with no other channel.
std::shared_ptr<grpc::Channel> connection_to(
    const std::string& address,
    const std::shared_ptr<grpc::ChannelCredentials>& credentials = grpc::InsecureChannelCredentials());

class LocalServer {
 public:
  // Starts the program `program`, which must accept locusd's options for its port. Returns UNAVAILABLE, with the
  // program's output, if it does not serve in time.
  static absl::StatusOr<std::unique_ptr<LocalServer>> start(const std::string& program);
  virtual ~LocalServer() = default;
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  const std::string& address() const { return address_; }
  const Process& process() const { return *process_; }
  // Returns the program's output up to now.
  std::string log() const;

  std::shared_ptr<grpc::Channel> channel() const { return connection_to(address_, credentials_); }

 protected:
  LocalServer() = default;
  // Starts the program with `options`, and options for its port. Call it once.
  absl::Status run(const std::string& program, const std::vector<std::string>& options);
  // Sets the credentials of channel(), which otherwise has none.
  void set_credentials(std::shared_ptr<grpc::ChannelCredentials> credentials) { credentials_ = std::move(credentials); }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<Process> process_;  // declared after folder_, so that it ends before its folder is removed
  std::string address_;
  std::shared_ptr<grpc::ChannelCredentials> credentials_ = grpc::InsecureChannelCredentials();
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_LOCAL_SERVER_H_
