// A complete server inside the test's process, behind a real socket on a free loopback port, and stubs to call it.
#ifndef LOCUS_TESTS_SUPPORT_RUNNING_SERVER_H_
#define LOCUS_TESTS_SUPPORT_RUNNING_SERVER_H_

#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "locus/v1/server_service.grpc.pb.h"
#include "locus/v1/update_service.grpc.pb.h"
#include "server/observability/log.h"
#include "server/rpc/library_logs.h"
#include "server/services/server.h"

namespace locus::test {

// Timeout of a call: far longer than any call takes, so that a hang fails a test instead of stopping the suite.
inline constexpr std::chrono::seconds kCallTimeout{60};

inline void set_timeout(grpc::ClientContext& context, std::chrono::milliseconds timeout = kCallTimeout) {
  context.set_deadline(std::chrono::system_clock::now() + timeout);
}

struct Stubs {
  // Opens a new connection; by default gRPC would share one connection between channels with equal arguments.
  explicit Stubs(const std::string& address) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetMaxReceiveMessageSize(-1);
    channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
    server = v1::ServerService::NewStub(channel);
    scenes = v1::SceneService::NewStub(channel);
    updates = v1::UpdateService::NewStub(channel);
    queries = v1::QueryService::NewStub(channel);
  }

  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::ServerService::Stub> server;
  std::unique_ptr<v1::SceneService::Stub> scenes;
  std::unique_ptr<v1::UpdateService::Stub> updates;
  std::unique_ptr<v1::QueryService::Stub> queries;
};

// Returns a server configuration for tests: two threads, a free port, no HTTP port.
inline server::ServerConfig test_config() {
  server::ServerConfig config;
  config.listen = {"127.0.0.1:0"};
  config.http_listen = "";
  config.threads = 2;
  config.memory_limit = limits::kMaxMemory;
  config.log_level = server::LogLevel::kError;
  return config;
}

class RunningServer {
 public:
  // Starts the server. `log` and `cluster`, which may be null, must outlive the server.
  explicit RunningServer(const server::ServerConfig& config = test_config(), UpdateLog* log = nullptr,
                         server::ClusterStorage* cluster = nullptr) {
    server::start_logging(config.log_level, config.log_format);
    server::capture_library_logs(config.log_level);
    absl::StatusOr<std::unique_ptr<server::Server>> started = server::Server::start(config, log, kNever, cluster);
    if (!started.ok()) ADD_FAILURE() << started.status();
    LOCUS_CHECK(started.ok());
    server_ = *std::move(started);
    stubs_ = std::make_unique<Stubs>(server_->addresses().front());
  }

  server::Server& server() { return *server_; }
  const std::string& address() const { return server_->addresses().front(); }
  Stubs& stubs() { return *stubs_; }

 private:
  static inline const std::atomic<bool> kNever{false};

  std::unique_ptr<server::Server> server_;
  std::unique_ptr<Stubs> stubs_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RUNNING_SERVER_H_
