#include "server/services/connections.h"

#include <grpcpp/security/server_credentials.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/config/connection_limits.h"
#include "server/config/listen_address.h"
#include "server/connections/frame_check.h"
#include "server/observability/log.h"
#include "server/rpc/tls_reads.h"
#include "server/scheduling/clocks.h"
#include "server/services/server_events.h"

namespace locus::server {
namespace {

// Returns the configured maximum number of connections. If none is configured, returns kDefaultConnections, or fewer if
// the process may not open enough files for that many connections, but at least kMinConnections.
uint32_t max_connections(const ServerConfig& config) {
  if (config.max_connections > 0) return config.max_connections;
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0 || files.rlim_cur == RLIM_INFINITY) return kDefaultConnections;
  const uint64_t spare = files.rlim_cur > kReservedFiles ? files.rlim_cur - kReservedFiles : 0;
  return static_cast<uint32_t>(std::clamp<uint64_t>(spare / kFilesPerConnection, kMinConnections, kDefaultConnections));
}

AcceptorOptions acceptor_options(const ServerConfig& config) {
  AcceptorOptions options;
  options.limits.connections = max_connections(config);
  options.limits.connections_per_address = config.max_connections_per_address;
  options.limits.new_per_second = config.max_new_connections;
  options.limits.burst = 2 * config.max_new_connections;
  options.tcp_transport = config.tls_cert.empty() ? Transport::kPlain : Transport::kTls;
  options.opening_timeout = std::chrono::seconds(config.handshake_timeout_s);
  options.idle_timeout = std::chrono::seconds(config.idle_timeout_s);
  return options;
}

// Maximum number of streams of a connection that have ended but are not destroyed yet. They are allowed in addition to
// the open streams.
constexpr uint64_t kEndedStreams = 512;

FloodLimits flood_limits(const ServerConfig& config, uint32_t streams) {
  FloodLimits limits;
  limits.message_bytes = config.max_receive_bytes;
  limits.streams = streams + kEndedStreams;
  return limits;
}

// Logs and audits connections that were refused; called at most once a second.
void note_refused(const RpcState& state, uint64_t refused, const std::string& address, const char* reason) {
  log(LogLevel::kWarning, "connections refused",
      {{"count", absl::StrCat(refused)}, {"last_address", address}, {"reason", reason}});
  report_connections(state, refused, address, "", absl::ResourceExhaustedError(absl::StrCat("refused: ", reason)));
}

// Counts, logs and audits a connection that was closed because it flooded the server.
void note_closed(RpcState& state, const Connection& connection, const char* reason) {
  ConnectionCounters& counters = state.connections.counters();
  (reason == FrameCheck::kLongHeaders ? counters.long_headers : counters.floods).fetch_add(1);
  log(LogLevel::kWarning, "connection closed", {{"peer", connection.peer().label}, {"reason", reason}});
  report_connections(state, 1, connection.peer().label, connection.peer().limit_key,
                     absl::ResourceExhaustedError(absl::StrCat("closed: ", reason)));
}

void log_ended(size_t closed, const char* reason) {
  if (closed == 0) return;
  log(LogLevel::kWarning, "connections closed", {{"count", absl::StrCat(closed)}, {"reason", reason}});
}

// Audits the TLS connections that failed since the counts in `before` were taken, and updates these counts. Called once
// a second.
void note_failed_tls(const RpcState& state, TlsCounts& before) {
  const TlsCounts now = tls_counts();
  const auto report = [&state](uint64_t count, const absl::Status& status) {
    if (count > 0) report_connections(state, count, "", "", status);
  };
  report(now.failed_handshakes - before.failed_handshakes, absl::UnauthenticatedError("the TLS handshake failed"));
  report(now.long_headers - before.long_headers + now.floods - before.floods,
         absl::ResourceExhaustedError("closed: a TLS connection flooded the server with frames"));
  before = now;
}

// Returns functions that report reloaded TLS files and failed handshakes. TLS checks a certificate only when a
// connection begins. Therefore, if clients need certificates, the functions also close connections: those whose
// certificate has expired and, after a client CA was removed, all TCP connections.
TlsHooks tls_hooks(const ServerConfig& config, RpcState& state) {
  TlsHooks hooks;
  hooks.reloaded = [&state](const absl::Status& status) { report_reload(state, state.tls_loads, "TLS files", status); };
  hooks.second_passed = [&state, before = std::make_shared<TlsCounts>(tls_counts())] {
    note_failed_tls(state, *before);
  };
  if (config.tls_client_ca.empty()) return hooks;
  ConnectionTable& table = state.connections;
  hooks.authority_removed = [&table] {
    constexpr const char* kReason = "a client CA was removed: clients must prove their certificates again";
    log_ended(table.close_if([](const Connection& connection) { return !connection.peer().uid; }, kReason), kReason);
  };
  hooks.second_passed = [&table, note_failures = hooks.second_passed] {
    note_failures();
    constexpr const char* kReason = "the client's certificate has expired";
    const int64_t now = unix_seconds();
    const auto has_expired = [now](const Connection& connection) {
      const int64_t end = connection.certificate_end.load(std::memory_order_relaxed);
      return end != 0 && end <= now;
    };
    log_ended(table.close_if(has_expired, kReason), kReason);
  };
  return hooks;
}

}  // namespace

std::vector<ConnectionLimit> connection_limits(const ServerConfig& config, const ConnectionTable& table) {
  const ConnectionCounters& counters = table.counters();
  return {
      {"connections", static_cast<double>(max_connections(config)), static_cast<double>(table.size()),
       counters.refused_full.load()},
      {"connections_per_address", static_cast<double>(config.max_connections_per_address), 0,
       counters.refused_address.load()},
      {"handshake_timeout_s", static_cast<double>(config.handshake_timeout_s), 0, counters.late.load()},
      {"header_bytes", static_cast<double>(FrameCheck::kMaxBlockBytes), 0,
       counters.long_headers.load() + tls_counts().long_headers},
      {"idle_timeout_s", static_cast<double>(config.idle_timeout_s), 0, counters.idle.load()},
      {"new_connections_per_s", static_cast<double>(config.max_new_connections), 0, counters.refused_too_fast.load()},
  };
}

std::vector<ConnectionMisuse> connection_misuses(const ConnectionTable& table) {
  const ConnectionCounters& counters = table.counters();
  const TlsCounts tls = tls_counts();
  return {{"first_bytes", counters.refused_bytes.load()},
          {"floods", counters.floods.load() + tls.floods},
          {"tls_handshake", tls.failed_handshakes}};
}

Connections::Connections(ServerConfig config, RpcState& state)
    : config_(std::move(config)), state_(state), stream_counter_(state.connections) {}

Connections::~Connections() = default;

absl::StatusOr<std::unique_ptr<Connections>> Connections::listen(const ServerConfig& config, RpcState& state) {
  std::unique_ptr<Connections> made(new Connections(config, state));
  if (!config.tls_cert.empty()) {
    state.tls_loads.start(unix_seconds());
    ASSIGN_OR_RETURN(made->tls_, TlsCredentials::start({config.tls_cert, config.tls_key, config.tls_client_ca},
                                                       tls_hooks(config, state)));
  }
  UnixAccess unix_access;
  unix_access.owner = config.unix_owner;
  ASSIGN_OR_RETURN(unix_access.mode, parse_unix_mode(config.unix_mode));
  for (const std::string& text : config.listen) {
    ASSIGN_OR_RETURN(const ListenAddress address, parse_listen_address(text));
    absl::StatusOr<std::vector<ListeningSocket>> sockets = listen_on(address, unix_access);
    if (!sockets.ok())
      return absl::Status(sockets.status().code(),
                          absl::StrCat("cannot listen on ", text, ": ", sockets.status().message()));
    const uint16_t port = sockets->front().port();
    made->addresses_.push_back(to_string(address, port));
    if (made->port_ == 0) made->port_ = port;
    for (ListeningSocket& listening : *sockets) made->sockets_.push_back(std::move(listening));
  }
  return made;
}

void Connections::add_to(grpc::ServerBuilder& builder, uint32_t streams) {
  if (sockets_.empty()) return;
  max_streams_ = streams;
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, static_cast<int>(streams));
  builder.AddChannelArgument(GRPC_ARG_ENABLE_CHANNELZ, 1);  // for StreamCounter
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS,
                             static_cast<int>(config_.handshake_timeout_s) * 1000);
  intake_ = std::make_unique<ConnectionIntake>(
      builder, tls_ == nullptr ? grpc::InsecureServerCredentials() : tls_->grpc_credentials());
}

void Connections::start(grpc::Server& server) {
  if (sockets_.empty()) {
    const auto now = std::chrono::steady_clock::now();
    return state_.connections.add(std::make_shared<Connection>(peer_in_process(), now, /*descriptor=*/-1));
  }
  intake_->started(server);
  guard_ = std::make_unique<FloodGuard>(
      flood_limits(config_, max_streams_), [this](Connection& connection) { return stream_counter_.count(connection); },
      [this](const Connection& connection, const char* reason) { note_closed(state_, connection, reason); });
  reads_ = std::make_unique<CheckedReads>(
      [this](Connection& connection, const char* reason) { guard_->close_for(connection, reason); });
  check_tls_reads([](const char* reason) { log(LogLevel::kWarning, "TLS connection closed", {{"reason", reason}}); });
  AcceptorHooks hooks;
  hooks.hand_over = [this](int descriptor, const std::shared_ptr<Connection>& connection) {
    const bool is_plain = tls_ == nullptr || connection->peer().uid;
    if (is_plain) {
      reads_->watch(descriptor, connection);
    } else {
      CheckedReads::forget(descriptor);
    }
    intake_->hand_over(descriptor, *connection);
  };
  hooks.refused = [this](uint64_t refused, const std::string& address, const char* reason) {
    note_refused(state_, refused, address, reason);
  };
  acceptor_ = std::make_unique<Acceptor>(std::move(sockets_), acceptor_options(config_), state_.connections, *guard_,
                                         std::move(hooks));
}

void Connections::stop_accepting() {
  if (acceptor_ != nullptr) acceptor_->stop_accepting();
}

}  // namespace locus::server
