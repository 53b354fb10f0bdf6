// Replacements of recvmsg(), SSL_read() and SSL_do_handshake() for the whole process; see tls_reads.h. This file is a
// target of its own, locus_read_hooks, so that programs can link a server without replacing functions of the system.
#include <dlfcn.h>
#include <openssl/ssl.h>
#include <sys/socket.h>

#include <cerrno>

#include "absl/strings/string_view.h"
#include "server/connections/checked_reads.h"
#include "server/rpc/tls_reads.h"

namespace locus::server {
namespace {

// Returns the function that a replacement of this file hides.
template <class Function>
Function original(Function, const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace
}  // namespace locus::server

extern "C" __attribute__((visibility("default"))) ssize_t recvmsg(int descriptor, msghdr* message, int flags) {
  static const auto kOriginal = locus::server::original(&recvmsg, "recvmsg");
  const ssize_t count = kOriginal(descriptor, message, flags);
  if (count <= 0 || (flags & (MSG_PEEK | MSG_ERRQUEUE)) != 0) return count;
  if (locus::server::CheckedReads::accept(descriptor, *message, static_cast<size_t>(count))) return count;
  errno = ECONNRESET;
  return -1;
}

extern "C" __attribute__((visibility("default"))) int SSL_do_handshake(SSL* ssl) {
  static const auto kOriginal = locus::server::original(&SSL_do_handshake, "SSL_do_handshake");
  const int result = kOriginal(ssl);
  locus::server::count_handshake(ssl, result);
  return result;
}

extern "C" __attribute__((visibility("default"))) int SSL_read(SSL* ssl, void* buffer, int size) {
  static const auto kOriginal = locus::server::original(&SSL_read, "SSL_read");
  const int count = kOriginal(ssl, buffer, size);
  if (count <= 0) return count;
  const absl::string_view bytes(static_cast<const char*>(buffer), static_cast<size_t>(count));
  return locus::server::accept_tls_read(ssl, bytes) ? count : -1;
}
