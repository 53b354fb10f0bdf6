// Where the daemon listens: a TCP address or the path of a unix socket, as an operator writes it. Plain data; made by
// parse_listen_address() only.
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
  uint16_t port = 0;  // 0 = any free one
  std::string path;   // unix only
  bool local = true;  // only this machine reaches it: a loopback address or a unix socket
};

// `host:port`, `[v6]:port` or `unix:/path`. A host name other than localhost counts as not local, since names may
// change what they mean. INVALID_ARGUMENT says what is wrong and shows an example.
absl::StatusOr<ListenAddress> parse_listen_address(absl::string_view text);

// As parse_listen_address() reads it, with `port` in place of the address's own.
std::string to_string(const ListenAddress& address, uint16_t port);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_LISTEN_ADDRESS_H_
