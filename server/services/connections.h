// The connections of a server: listens on the addresses of the configuration, accepts connections, hands them to gRPC,
// and closes connections that flood the server.
//
// Threads: one thread at a time. Order: listen(), add_to(), start(), stop_accepting(), shutdown of the gRPC server, and
// then the destructor.
#ifndef LOCUS_SERVER_SERVICES_CONNECTIONS_H_
#define LOCUS_SERVER_SERVICES_CONNECTIONS_H_

#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/config/server_config.h"
#include "server/connections/acceptor.h"
#include "server/connections/checked_reads.h"
#include "server/connections/connection_table.h"
#include "server/connections/flood_guard.h"
#include "server/rpc/connection_intake.h"
#include "server/rpc/rpc_state.h"
#include "server/rpc/stream_counter.h"
#include "server/rpc/tls_credentials.h"

namespace locus::server {

// A limit on the number of connections, or on the behaviour of each connection.
struct ConnectionLimit {
  const char* name;      // as in `locus limits`
  double value = 0;      // 0 = no limit
  double used = 0;       // for the limit `connections`: number of open connections; 0 for all other limits
  uint64_t refused = 0;  // connections that were refused or closed because of this limit since the start
};
// Returns the limits on connections.
std::vector<ConnectionLimit> connection_limits(const ServerConfig& config, const ConnectionTable& table);

// Number of connections that were refused or closed for a reason that is no configurable limit.
struct ConnectionMisuse {
  const char* name;  // value of the label `limit` of the metric locus_connections_refused_total
  uint64_t refused = 0;
};
// Returns the counts of all kinds of misuse.
std::vector<ConnectionMisuse> connection_misuses(const ConnectionTable& table);

class Connections {
 public:
  // Reads the files of TLS and listens on all addresses. Returns an error that names the file or the address that
  // cannot be used, and the reason. `state` must outlive the result.
  static absl::StatusOr<std::unique_ptr<Connections>> listen(const ServerConfig& config, RpcState& state);
  ~Connections();
  Connections(const Connections&) = delete;
  Connections& operator=(const Connections&) = delete;

  // Prepares `builder`, so that its server takes over accepted connections, each with at most `streams` open streams.
  // Like start(), does nothing if the configuration has no addresses.
  void add_to(grpc::ServerBuilder& builder, uint32_t streams);
  // Starts accepting connections for `server`, which `builder` of add_to() has built.
  void start(grpc::Server& server);
  // Reads the files of TLS again. Returns true if the files have changed and the new contents are in use.
  bool reload_tls() { return tls_ != nullptr && tls_->reload(); }
  // Returns the files of TLS that are in use, so that other ports can use them; null without TLS.
  const TlsCredentials* tls() const { return tls_.get(); }
  // Closes the listening sockets; the connections stay.
  void stop_accepting();

  // Returns the addresses as clients write them, with the bound ports, in the order of the config.
  const std::vector<std::string>& addresses() const { return addresses_; }
  // Returns the port of the first TCP address; 0 if there is none.
  uint16_t port() const { return port_; }

 private:
  Connections(ServerConfig config, RpcState& state);

  const ServerConfig config_;
  RpcState& state_;
  std::vector<ListeningSocket> sockets_;
  std::vector<std::string> addresses_;
  uint16_t port_ = 0;
  std::unique_ptr<TlsCredentials> tls_;  // null without TLS
  std::unique_ptr<ConnectionIntake> intake_;
  uint32_t max_streams_ = 0;
  StreamCounter stream_counter_;  // used by the thread of the FloodGuard
  std::unique_ptr<FloodGuard> guard_;
  std::unique_ptr<CheckedReads> reads_;
  std::unique_ptr<Acceptor> acceptor_;  // declared last and so destroyed first, because it uses the members above
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_CONNECTIONS_H_
