#include "client/embedded/embedded_server.h"

#include <chrono>
#include <utility>

#include "absl/strings/string_view.h"
#include "client/lib/call_gate.h"
#include "core/base/status_macros.h"
#include "core/scene/log/update_log.h"
#include "grpcpp/channel.h"
#include "grpcpp/support/channel_arguments.h"
#include "server/config/server_config.h"
#include "server/observability/log.h"
#include "server/services/server.h"
#include "server/storage/rocksdb_log.h"

namespace locus::client {
namespace {

// Returns the configuration of a server without addresses, which only its own process can call.
server::ServerConfig config_of(const EmbeddedOptions& options) {
  server::ServerConfig config;
  config.listen.clear();
  config.http_listen.clear();
  config.data_dir = options.data_dir;
  config.threads = options.threads;
  config.memory_limit = options.memory_limit;
  server::follow_machine(config);
  return config;
}

absl::StatusOr<std::unique_ptr<UpdateLog>> open_log(const std::string& path) {
  if (path.empty()) return nullptr;
  server::StorageOptions options;
  options.path = path;
  options.warn = [](absl::string_view text) {
    server::log(server::LogLevel::kWarning, "warning of the storage library", {{"text", std::string(text)}});
  };
  return server::RocksdbLog::open(options);
}

}  // namespace

struct EmbeddedServer::Parts {
  std::unique_ptr<UpdateLog> log;  // destroyed after the server, which writes to it; null without a data directory
  std::unique_ptr<server::Server> server;
  std::shared_ptr<CallGate> gate = std::make_shared<CallGate>();
};

EmbeddedServer::EmbeddedServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

EmbeddedServer::~EmbeddedServer() {
  CallGate& gate = *parts_->gate;
  gate.close();
  parts_->server->drain(std::chrono::milliseconds(0), [&gate] { gate.wait_until_empty(); });
}

absl::StatusOr<std::unique_ptr<EmbeddedServer>> EmbeddedServer::start(const EmbeddedOptions& options) {
  auto parts = std::make_unique<Parts>();
  ASSIGN_OR_RETURN(parts->log, open_log(options.data_dir));
  ASSIGN_OR_RETURN(parts->server, server::Server::start(config_of(options), parts->log.get()));
  return std::unique_ptr<EmbeddedServer>(new EmbeddedServer(std::move(parts)));
}

std::unique_ptr<Client> EmbeddedServer::connect(const ClientOptions& options) const {
  grpc::ChannelArguments arguments;
  arguments.SetMaxSendMessageSize(options.max_send_bytes);
  arguments.SetMaxReceiveMessageSize(options.max_receive_bytes);
  return Client::in_process(parts_->server->in_process_channel(arguments), parts_->gate, options);
}

}  // namespace locus::client
