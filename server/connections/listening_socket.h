// Sockets that listen on an address of the configuration. Errors say why an address cannot be used, for the operator
// who starts the daemon.
//
// Threads: a socket belongs to one thread at a time. Invariant: the file of a unix socket exists as long as its socket,
// and a file that belongs to another process is never replaced or removed.
#ifndef LOCUS_SERVER_CONNECTIONS_LISTENING_SOCKET_H_
#define LOCUS_SERVER_CONNECTIONS_LISTENING_SOCKET_H_

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "server/config/listen_address.h"

namespace locus::server {

// Permissions to connect to a unix socket.
struct UnixAccess {
  uint32_t mode = 0600;  // permissions of the file; connecting needs write permission
  std::string owner;     // user or user:group, by name or number; empty = user and group of the process
};

// A non-blocking socket that listens. The destructor closes it and removes the file of a unix socket.
class ListeningSocket {
 public:
  explicit ListeningSocket(int descriptor) : descriptor_(descriptor) {}
  ListeningSocket(ListeningSocket&& other) noexcept { *this = std::move(other); }
  ListeningSocket& operator=(ListeningSocket&& other) noexcept;
  ~ListeningSocket() { close(); }

  int descriptor() const { return descriptor_; }
  // Returns the bound port; 0 for a unix socket.
  uint16_t port() const;
  bool local() const { return !path_.empty(); }  // whether it is a unix socket

  // Stops listening. Connections that were not accepted yet are reset.
  void close();

 private:
  friend absl::StatusOr<std::vector<ListeningSocket>> listen_on(const ListenAddress& address,
                                                                const UnixAccess& unix_access);

  int descriptor_ = -1;
  std::string path_;  // path of the unix socket's file, to be removed
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

// Listens on `address`: one socket, or one for each address of a host name. With port 0, all sockets get the same free
// port. Returns ALREADY_EXISTS if another process answers on the unix socket, and UNAVAILABLE for other reasons.
absl::StatusOr<std::vector<ListeningSocket>> listen_on(const ListenAddress& address, const UnixAccess& unix_access);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_LISTENING_SOCKET_H_
