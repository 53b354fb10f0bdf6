#include "server/services/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/config/listen_address.h"
#include "server/host/host.h"
#include "server/observability/http_server.h"
#include "server/observability/log.h"
#include "server/rpc/io_threads.h"
#include "server/rpc/listening.h"
#include "server/services/backup.h"
#include "server/services/health_service.h"
#include "server/services/query_service.h"
#include "server/services/recovery.h"
#include "server/services/scene_service.h"
#include "server/services/scrape.h"
#include "server/services/server_service.h"
#include "server/services/update_service.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

// Threads for gRPC itself, and for calls that are refused because the limit on calls is reached.
constexpr int kSpareThreads = 64;
// gRPC's buffers may use 1 / kNetworkShare of the memory limit, but at least kMinNetworkBytes, which is enough for a
// few of the largest messages.
constexpr uint64_t kNetworkShare = 8;
constexpr size_t kMinNetworkBytes = size_t{256} << 20;
// Interval in milliseconds between keepalive pings to clients, and maximum delay of the answer. The pings detect
// clients whose machine is unreachable, whose streams would otherwise stay open for ever.
constexpr int kPingEveryMs = 30'000;
constexpr int kPingAnswerMs = 10'000;
// Minimum interval in milliseconds between keepalive pings of a client, with which it detects that this server is
// unreachable.
constexpr int kMinPingIntervalMs = 5'000;
// Time that gRPC has, after all calls have finished, to send the last statuses and to end the health watchers.
constexpr milliseconds kLastWords{500};

absl::StatusOr<std::vector<ListenAddress>> read_addresses(const ServerConfig& config) {
  std::vector<ListenAddress> addresses;
  for (const std::string& text : config.listen) {
    ASSIGN_OR_RETURN(ListenAddress address, parse_listen_address(text));
    if (absl::Status status = check_free(address); !status.ok())
      return absl::Status(status.code(), absl::StrCat("cannot listen on ", text, ": ", status.message()));
    addresses.push_back(std::move(address));
  }
  return addresses;
}

// Starts the HTTP pages. Returns null if no HTTP port is wanted, or if the default address is in use.
absl::StatusOr<std::unique_ptr<HttpServer>> start_http(const ServerConfig& config, Scrape& scrape) {
  if (config.http_listen.empty()) return nullptr;
  ASSIGN_OR_RETURN(const ListenAddress address, parse_listen_address(config.http_listen));
  absl::StatusOr<std::unique_ptr<HttpServer>> http = HttpServer::start(address, scrape.pages());
  if (http.ok()) return http;
  const std::string text =
      absl::StrCat("cannot listen on ", config.http_listen, " for metrics and health pages: ", why_not(address));
  if (config.http_listen != kDefaultHttpListen) return absl::UnavailableError(text);
  log(LogLevel::kWarning, text, {{"hint", "choose another address with --http-listen, or none by leaving it empty"}});
  return nullptr;
}

// Registers server reflection, once for the process. Call it before the first ServerBuilder is constructed.
void enable_extras() {
  static const bool kDone = [] {
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    return true;
  }();
  static_cast<void>(kDone);
}

void set_limits(const ServerConfig& config, grpc::ServerBuilder& builder) {
  grpc::ResourceQuota quota("locusd");
  const int calls = static_cast<int>(config.max_calls);
  quota.SetMaxThreads(2 * calls + kSpareThreads);
  // Bounds the memory of messages in transit. When it is used up, gRPC closes connections of callers that never read.
  quota.Resize(std::max(kMinNetworkBytes, static_cast<size_t>(config.memory_limit / kNetworkShare)));
  builder.SetResourceQuota(quota);
  builder.SetMaxReceiveMessageSize(static_cast<int>(config.max_receive_bytes));
  builder.SetMaxSendMessageSize(-1);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             static_cast<int>(config.max_streams) + calls + kSpareThreads);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kPingEveryMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingAnswerMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinPingIntervalMs);
  // By default, two daemons could listen on one port and would share its calls at random. Make the second daemon fail.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
}

}  // namespace

struct Server::Parts {
  Parts(const ServerConfig& config, UpdateLog* log)
      : host(config, log),
        scrape(host),
        health_service(host),
        server_service(host),
        scene_service(host),
        update_service(host),
        query_service(host) {}

  std::vector<grpc::Service*> services() {
    return {&health_service, &server_service, &scene_service, &update_service, &query_service};
  }

  std::unique_ptr<IoThreads> io;  // declared first, so destroyed last: work that ends with `host` may post to it
  Host host;
  Scrape scrape;
  HealthService health_service;
  ServerService server_service;
  SceneService scene_service;
  UpdateService update_service;
  QueryService query_service;
  std::unique_ptr<grpc::Server> grpc;
  std::unique_ptr<HttpServer> http;  // runs from before the first call until after the last
  bool ended = false;
};

Server::Server(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

Server::~Server() {
  if (!parts_->ended) drain(milliseconds(0));
}

absl::StatusOr<std::unique_ptr<Server>> Server::start(const ServerConfig& config, UpdateLog* log,
                                                      const std::atomic<bool>& stop) {
  ASSIGN_OR_RETURN(const std::vector<ListenAddress> addresses, read_addresses(config));
  enable_extras();
  auto parts = std::make_unique<Parts>(config, log);
  if (can_back_up(parts->host)) remove_leftover_backup(parts->host);
  parts->host.recovering = log != nullptr;
  ASSIGN_OR_RETURN(std::unique_ptr<HttpServer> http, start_http(config, parts->scrape));
  parts->http = std::move(http);
  grpc::ServerBuilder builder;
  set_limits(config, builder);
  std::vector<int> ports(addresses.size(), 0);
  for (size_t i = 0; i < addresses.size(); ++i)
    builder.AddListeningPort(config.listen[i], grpc::InsecureServerCredentials(), &ports[i]);
  for (grpc::Service* service : parts->services()) builder.RegisterService(service);
  parts->io = std::make_unique<IoThreads>(builder, IoThreads::count_for(config.threads));
  parts->grpc = builder.BuildAndStart();
  if (parts->grpc == nullptr) {
    parts->ended = true;
    const size_t failed = static_cast<size_t>(std::find(ports.begin(), ports.end(), 0) - ports.begin());
    if (failed == ports.size()) return absl::InternalError("gRPC could not start the server");
    return absl::UnavailableError(
        absl::StrCat("cannot listen on ", config.listen[failed], ": ", why_not(addresses[failed])));
  }
  parts->update_service.listen(*parts->io);
  parts->query_service.listen(*parts->io);
  parts->io->start();
  std::unique_ptr<Server> server(new Server(std::move(parts)));
  for (size_t i = 0; i < addresses.size(); ++i) {
    const auto port = static_cast<uint16_t>(ports[i]);
    server->addresses_.push_back(to_string(addresses[i], port));
    const bool tcp = addresses[i].kind == ListenAddress::Kind::kTcp;
    if (tcp && server->port_ == 0) server->port_ = port;
  }
  Host& host = server->parts_->host;
  if (log != nullptr) RETURN_IF_ERROR(recover_all(host, stop));
  host.recovering = false;
  server->parts_->health_service.serving();
  server->parts_->scrape.serving(server->addresses_);
  return server;
}

uint16_t Server::http_port() const { return parts_->http == nullptr ? 0 : parts_->http->port(); }

void Server::drain(milliseconds grace) {
  const steady_clock::time_point deadline = steady_clock::now() + grace;
  Host& host = parts_->host;
  parts_->health_service.not_serving();
  host.drain.begin();
  parts_->io->drain();
  const bool idle = host.streams.wait_until_empty(deadline) && host.calls.wait_until_empty(deadline);
  host.drain.end();
  parts_->health_service.end();
  parts_->grpc->Shutdown(system_clock::now() + (idle ? kLastWords : milliseconds(0)));
  parts_->grpc->Wait();
  parts_->io->stop();
  parts_->http.reset();
  parts_->ended = true;
}

}  // namespace locus::server
