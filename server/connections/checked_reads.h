// Checks the bytes that the transport reads from connections without TLS, before the transport parses them. The
// transport reads with recvmsg(), which server/rpc/read_hooks.cc replaces by a function that passes each read to
// CheckedReads::accept(). Bytes of descriptors that are not watched are always accepted.
//
// Threads: every member may be called from any thread; reads of different descriptors rarely wait for each other.
// Invariant: bytes are checked only if their descriptor still refers to the watched socket. The transport closes
// descriptors without a notification and the kernel reuses their numbers, so the socket's cookie, which the kernel
// assigns to no other socket, is compared.
#ifndef LOCUS_SERVER_CONNECTIONS_CHECKED_READS_H_
#define LOCUS_SERVER_CONNECTIONS_CHECKED_READS_H_

#include <sys/socket.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <utility>

#include "server/connections/connection.h"

namespace locus::server {

class CheckedReads {
 public:
  using OnRefused = std::function<void(Connection& connection, const char* reason)>;

  // `on_refused` is called on the reading thread, once for each connection whose bytes are refused. It must not call
  // recvmsg().
  explicit CheckedReads(OnRefused on_refused) : on_refused_(std::move(on_refused)) {}
  // Stops checking; `on_refused` is not called any more.
  ~CheckedReads();
  CheckedReads(const CheckedReads&) = delete;
  CheckedReads& operator=(const CheckedReads&) = delete;

  // Begins to check the reads from `descriptor`, the socket of `connection`, from which nothing was read yet.
  void watch(int descriptor, std::shared_ptr<Connection> connection);

  // Stops checking the reads from `descriptor`. Call it when the descriptor belongs to a socket that is not watched.
  static void forget(int descriptor);

  // Checks `count` bytes that were read from `descriptor` into `message`. Returns false if the bytes are refused; then
  // `on_refused` was called, and the transport must not get the bytes. Costs about 0.1 us for a watched descriptor.
  static bool accept(int descriptor, const msghdr& message, size_t count);

 private:
  const OnRefused on_refused_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_CHECKED_READS_H_
