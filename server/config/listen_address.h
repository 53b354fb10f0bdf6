// Address that the daemon listens on, as an operator writes it: a TCP address or the path of a unix socket. Plain data,
// made by parse_listen_address() only.
#ifndef LOCUS_SERVER_CONFIG_LISTEN_ADDRESS_H_
#define LOCUS_SERVER_CONFIG_LISTEN_ADDRESS_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::server {

struct ListenAddress {
  enum class Kind : uint8_t { kTcp, kUnix };
  Kind kind = Kind::kTcp;
  std::string host;   // without brackets; empty for unix
  uint16_t port = 0;  // 0 = any free port
  std::string path;   // unix sockets only
  bool local = true;  // reachable from this machine only: a loopback address or a unix socket
};

// Parses `host:port`, `[v6]:port` or `unix:/path`. A host name other than localhost is not local, because it may
// resolve to another address later. Returns INVALID_ARGUMENT with the reason and an example.
absl::StatusOr<ListenAddress> parse_listen_address(absl::string_view text);

// Returns the address in the form that parse_listen_address() reads, with `port` instead of the address's own port.
std::string to_string(const ListenAddress& address, uint16_t port);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_LISTEN_ADDRESS_H_
