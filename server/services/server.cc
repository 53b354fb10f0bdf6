#include "server/services/server.h"

#include <grpcpp/resource_quota.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <grpcpp/support/channel_arguments.h>

#include <algorithm>
#include <functional>
#include <future>
#include <thread>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/config/listen_address.h"
#include "server/host/host.h"
#include "server/host/memory_lines.h"
#include "server/observability/http_server.h"
#include "server/observability/log.h"
#include "server/rpc/blocking_calls.h"
#include "server/rpc/io_threads.h"
#include "server/services/access.h"
#include "server/services/backup.h"
#include "server/services/cluster/cluster_meshes.h"
#include "server/services/cluster/cluster_scenes.h"
#include "server/services/connections.h"
#include "server/services/health_service.h"
#include "server/services/query_service.h"
#include "server/services/recovery.h"
#include "server/services/reflection.h"
#include "server/services/scene_service.h"
#include "server/services/scrape.h"
#include "server/services/server_service.h"
#include "server/services/update_service.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

// Maximum number of calls of the health and reflection services on one connection. These services have limits of their
// own.
constexpr uint32_t kOtherCalls = kMaxHealthWatchers + kMaxHealthChecks + kMaxReflections;
// Maximum number of bytes that gRPC takes from a connection in one read.
constexpr int kMaxReadBytes = 256 << 10;
// Time that gRPC's Shutdown() has after its deadline. If it has not ended by then, all connections are closed.
constexpr std::chrono::seconds kCloseAfter{2};
// Interval in milliseconds between keepalive pings to clients, and maximum delay of the answer to a ping. The pings
// detect clients whose machine is unreachable. The streams of such clients would otherwise stay open for ever.
constexpr int kPingEveryMs = 30'000;
constexpr int kPingAnswerMs = 10'000;
// Minimum interval in milliseconds between keepalive pings from a client. With these pings a client detects that this
// server is unreachable.
constexpr int kMinPingIntervalMs = 5'000;
// Time that a member of a cluster has to hand its scenes over, even if the grace period is shorter.
constexpr std::chrono::seconds kHandOverWait{5};
// Maximum time that gRPC has, after all calls have ended, to send the last statuses and to end the health watchers.
constexpr milliseconds kLastWords{500};

// Starts serving the HTTP pages, over TLS if `tls` is not null. Returns null if the config turns them off, or if they
// cannot be served on the default address.
absl::StatusOr<std::unique_ptr<HttpServer>> start_http(const ServerConfig& config, const TlsCredentials* tls,
                                                       Scrape& scrape) {
  if (config.http_listen.empty()) return nullptr;
  ASSIGN_OR_RETURN(const ListenAddress address, parse_listen_address(config.http_listen));
  HttpServer::Certificates certificates;
  if (tls != nullptr) certificates = [tls] { return tls->contents(); };
  absl::StatusOr<std::unique_ptr<HttpServer>> http = HttpServer::start(address, scrape.pages(), certificates);
  if (http.ok()) return http;
  const std::string text =
      absl::StrCat("cannot listen on ", config.http_listen, " for metrics and health pages: ", http.status().message());
  if (config.http_listen != kDefaultHttpListen) return absl::UnavailableError(text);
  log(LogLevel::kWarning, text, {{"hint", "choose another address with --http-listen, or none by leaving it empty"}});
  return nullptr;
}

// Returns the maximum number of concurrent calls that each block a thread.
uint32_t max_blocking_calls(const Host& host) {
  return host.calls.max_in_all() + host.health_watchers.max_in_all() + host.health_checks.max_in_all() +
         host.reflections.max_in_all();
}

void set_limits(const ServerConfig& config, grpc::ServerBuilder& builder) {
  grpc::ResourceQuota quota("locusd");
  // Bound the memory of messages in transit. When the quota is used up, gRPC closes connections of callers that never
  // read.
  quota.Resize(network_ceiling(config.memory_limit));
  builder.SetResourceQuota(quota);
  builder.SetMaxReceiveMessageSize(static_cast<int>(config.max_receive_bytes));
  builder.SetMaxSendMessageSize(-1);
  // gRPC must not inflate messages, because a few megabytes could become gigabytes. It refuses compressed messages or,
  // with accept_compression, passes them on still compressed.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, config.accept_compression);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  // gRPC handles all frames of a read before it reports the first call. A read of 4 MiB, gRPC's default maximum, may
  // contain calls that take a gigabyte of memory. Reads of 32 KiB made large messages 10 to 20 % slower.
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kMaxReadBytes);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kPingEveryMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingAnswerMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinPingIntervalMs);
}

// Returns the address at which the other members of a cluster reach this server.
std::string advertised_address(const ServerConfig& config, const std::vector<std::string>& listening) {
  if (!config.advertise.empty()) return config.advertise;
  const auto tcp = std::find_if(listening.begin(), listening.end(),
                                [](const std::string& address) { return !absl::StartsWith(address, "unix:"); });
  LOCUS_CHECK(tcp != listening.end());  // checked with the options
  return *tcp;
}

}  // namespace

struct Server::Parts {
  Parts(const ServerConfig& config, UpdateLog* log)
      : host(config, log),
        scrape(host),
        health_service(host),
        update_service(host),
        query_service(host),
        blocking_calls(host, max_blocking_calls(host)) {
    if (config.accept_compression) host.max_inflated_bytes = config.max_receive_bytes;
    blocking_calls.add(health_service.methods());
    blocking_calls.add(server_methods(host));
    blocking_calls.add(scene_methods(host));
    blocking_calls.add(reflection_method(host));
  }

  ~Parts() {
    if (storage == nullptr) return;
    storage->notices->deliver_to({});
    cluster->end();
  }

  // Makes the server a member of a cluster, which does not begin to lead yet.
  void join(ClusterStorage& with, const std::string& address) {
    storage = &with;
    meshes = std::make_unique<ClusterMeshes>(host, *with.log);
    cluster = std::make_unique<ClusterScenes>(host, with, address);
    host.cluster_meshes = meshes.get();
    host.cluster = cluster.get();
    with.notices->deliver_to(
        {[this](SceneKey scene, uint64_t token) { cluster->fenced(scene, token); },
         [this](SceneKey scene, uint64_t before, uint64_t now) { cluster->token_raised(scene, before, now); }});
  }

  // Declared first and so destroyed last, because work that ends while `host` is destroyed may post to the loops.
  std::unique_ptr<IoThreads> io;
  // The part in a cluster; null without one. Destroyed after `host`, whose last jobs use it; ~Parts() ends its threads,
  // which use `host`.
  ClusterStorage* storage = nullptr;
  std::unique_ptr<ClusterMeshes> meshes;
  std::unique_ptr<ClusterScenes> cluster;
  Host host;
  std::unique_ptr<Access> access;
  Scrape scrape;
  HealthService health_service;
  UpdateService update_service;
  QueryService query_service;
  BlockingCalls blocking_calls;
  std::unique_ptr<Connections> connections;  // destroyed after the gRPC server, which reads from them
  std::unique_ptr<grpc::Server> grpc;
  std::unique_ptr<HttpServer> http;  // started before the first call is served, ended after the last call
  bool ended = false;
};

Server::Server(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

Server::~Server() {
  if (!parts_->ended) drain(milliseconds(0));
}

absl::StatusOr<std::unique_ptr<Server>> Server::start(const ServerConfig& config, UpdateLog* log,
                                                      const std::atomic<bool>& stop, ClusterStorage* cluster) {
  auto parts = std::make_unique<Parts>(config, log);
  ASSIGN_OR_RETURN(parts->access, Access::open(config, parts->host));
  ASSIGN_OR_RETURN(parts->connections, Connections::listen(config, parts->host));
  if (can_back_up(parts->host)) remove_leftover_backup(parts->host);
  if (cluster != nullptr) parts->join(*cluster, advertised_address(config, parts->connections->addresses()));
  parts->host.recovering = log != nullptr;
  ASSIGN_OR_RETURN(std::unique_ptr<HttpServer> http, start_http(config, parts->connections->tls(), parts->scrape));
  parts->http = std::move(http);
  if (parts->http != nullptr) {
    ASSIGN_OR_RETURN(const ListenAddress address, parse_listen_address(config.http_listen));
    parts->host.http_host = address.host;
    parts->host.http_port = parts->http->port();
  }
  grpc::ServerBuilder builder;
  set_limits(config, builder);
  parts->connections->add_to(builder, config.max_streams + config.max_calls + kOtherCalls);
  builder.RegisterService(&parts->update_service);
  builder.RegisterService(&parts->query_service);
  builder.RegisterAsyncGenericService(&parts->blocking_calls.service());
  parts->io = std::make_unique<IoThreads>(builder, IoThreads::count_for(config.threads));
  parts->grpc = builder.BuildAndStart();
  if (parts->grpc == nullptr) {
    parts->ended = true;
    return absl::InternalError("gRPC could not start the server");
  }
  parts->update_service.listen(*parts->io);
  parts->query_service.listen(*parts->io);
  parts->blocking_calls.listen(*parts->io);
  parts->io->start();
  parts->access->start([&io = *parts->io] { io.recheck(); });
  parts->connections->start(*parts->grpc);
  std::unique_ptr<Server> server(new Server(std::move(parts)));
  Host& host = server->parts_->host;
  if (log != nullptr) RETURN_IF_ERROR(recover_all(host, stop));
  host.start_lifetimes();
  if (cluster != nullptr) server->parts_->cluster->start();
  host.recovering = false;
  server->parts_->health_service.serving();
  server->parts_->scrape.serving(server->addresses());
  return server;
}

std::shared_ptr<grpc::Channel> Server::in_process_channel(const grpc::ChannelArguments& arguments) const {
  LOCUS_CHECK(addresses().empty());
  return parts_->grpc->InProcessChannel(arguments);
}

const std::vector<std::string>& Server::addresses() const { return parts_->connections->addresses(); }

uint16_t Server::port() const { return parts_->connections->port(); }

uint16_t Server::http_port() const { return parts_->http == nullptr ? 0 : parts_->http->port(); }

bool Server::reload_tls() { return parts_->connections->reload_tls(); }

void Server::reload() {
  parts_->access->reload();
  reload_tls();
}

void Server::drain(milliseconds grace, const std::function<void()>& before_closing) {
  Host& host = parts_->host;
  // Accept new connections until all calls have ended or `deadline` has passed, so that probes get NOT_SERVING.
  parts_->health_service.not_serving();
  // Calls are served until the scenes are handed over.
  if (parts_->cluster != nullptr)
    parts_->cluster->drain(steady_clock::now() + std::max<milliseconds>(grace, kHandOverWait));
  const steady_clock::time_point deadline = steady_clock::now() + grace;
  host.drain.begin();
  host.lifetimes.stop();
  host.lease_ends.stop();
  parts_->access->stop();
  parts_->io->drain();
  const bool idle = host.streams.wait_until_empty(deadline) && host.calls.wait_until_empty(deadline);
  parts_->connections->stop_accepting();
  host.drain.end();
  parts_->health_service.end();
  if (before_closing != nullptr) before_closing();
  const milliseconds last_words = idle ? milliseconds(kLastWords) : milliseconds(0);
  // Shutdown() waits without a limit for a client that does not read its responses. Therefore another thread closes all
  // connections if gRPC has not ended in time.
  std::promise<void> ended;
  std::thread closer([&host, last_words, future = ended.get_future()] {
    if (future.wait_for(last_words + kCloseAfter) == std::future_status::ready) return;
    host.connections.close_if([](const Connection&) { return true; }, "the server ends");
  });
  parts_->grpc->Shutdown(system_clock::now() + last_words);
  parts_->grpc->Wait();
  ended.set_value();
  closer.join();
  parts_->io->stop();
  parts_->http.reset();
  parts_->ended = true;
}

}  // namespace locus::server
