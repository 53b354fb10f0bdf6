// Address that the daemon listens on, as an operator writes it: a TCP address or the path of a unix socket. Plain data;
// only parse_listen_address() constructs it.
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
  std::string host;   // without brackets; empty for a unix socket
  uint16_t port = 0;  // 0 = any free port
  std::string path;   // path of a unix socket; empty for TCP
  bool local = true;  // whether only this machine can reach the address: a loopback address or a unix socket
};

// Parses `host:port`, `[v6]:port` or `unix:/path`. For a host name other than localhost, `local` is false, because the
// name may resolve to another address later. For an invalid text returns INVALID_ARGUMENT with the reason and an
// example.
absl::StatusOr<ListenAddress> parse_listen_address(absl::string_view text);

// Returns the address in the form that parse_listen_address() reads, with `port` instead of the address's own port.
std::string to_string(const ListenAddress& address, uint16_t port);

// Parses the permissions of a unix socket: three octal digits, with or without a leading 0. Returns INVALID_ARGUMENT
// for any other text.
absl::StatusOr<uint32_t> parse_unix_mode(absl::string_view text);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_LISTEN_ADDRESS_H_
