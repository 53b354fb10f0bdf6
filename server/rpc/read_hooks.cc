#include "server/rpc/read_hooks.h"

#include <dlfcn.h>
#include <openssl/ssl.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <memory>

#include "absl/strings/string_view.h"
#include "core/base/check.h"
#include "server/connections/checked_reads.h"
#include "server/connections/frame_check.h"

namespace locus::server {
namespace {

using OnRefused = void (*)(const char* reason);

void free_check(void*, void* check, CRYPTO_EX_DATA*, int, long, void*) { delete static_cast<FrameCheck*>(check); }

struct TlsChecks {
  OnRefused on_refused;
  int index;  // index under which OpenSSL stores the FrameCheck of a connection
};

std::atomic<const TlsChecks*> tls_checks{nullptr};  // null until check_tls_reads()

std::atomic<uint64_t> failed_handshakes{0}, long_headers{0}, floods{0};  // see TlsCounts

// Returns whether the two peers have agreed on a protocol. gRPC offers h2 and grpc-exp, which are both HTTP/2; the HTTP
// port of metrics offers no protocol.
bool has_chosen_http2(const SSL* ssl) {
  const unsigned char* name = nullptr;
  unsigned int size = 0;
  SSL_get0_alpn_selected(ssl, &name, &size);
  return size > 0;
}

// Checks bytes that were read from a TLS connection. Returns false if they are refused.
bool accept(SSL* ssl, absl::string_view bytes) {
  const TlsChecks* checks = tls_checks.load();
  if (checks == nullptr || SSL_is_server(ssl) == 0 || !has_chosen_http2(ssl)) return true;
  auto* check = static_cast<FrameCheck*>(SSL_get_ex_data(ssl, checks->index));
  if (check == nullptr) {
    auto made = std::make_unique<FrameCheck>();
    if (SSL_set_ex_data(ssl, checks->index, made.get()) == 0) return false;  // out of memory
    check = made.release();
  }
  const char* reason = check->refusal(bytes, std::chrono::steady_clock::now());
  if (reason != nullptr) {
    (reason == FrameCheck::kLongHeaders ? long_headers : floods).fetch_add(1);
    checks->on_refused(reason);
  }
  return reason == nullptr;
}

// Counts the handshake if it has failed. `result` is the result of SSL_do_handshake() for one step of a handshake.
void count_handshake(SSL* ssl, int result) {
  if (result > 0 || SSL_is_server(ssl) == 0) return;
  const int error = SSL_get_error(ssl, result);
  if (error != SSL_ERROR_WANT_READ && error != SSL_ERROR_WANT_WRITE) failed_handshakes.fetch_add(1);
}

}  // namespace

TlsCounts tls_counts() { return {failed_handshakes.load(), long_headers.load(), floods.load()}; }

void check_tls_reads(OnRefused on_refused) {
  // Check that gRPC will call our functions. It would call the original ones if, for example, it were linked
  // statically.
  LOCUS_CHECK(dlsym(RTLD_DEFAULT, "recvmsg") == reinterpret_cast<void*>(&recvmsg));
  LOCUS_CHECK(dlsym(RTLD_DEFAULT, "SSL_read") == reinterpret_cast<void*>(&SSL_read));
  LOCUS_CHECK(dlsym(RTLD_DEFAULT, "SSL_do_handshake") == reinterpret_cast<void*>(&SSL_do_handshake));
  static const TlsChecks kChecks{on_refused, SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, free_check)};
  tls_checks.store(&kChecks);
}

}  // namespace locus::server

extern "C" __attribute__((visibility("default"))) ssize_t recvmsg(int descriptor, msghdr* message, int flags) {
  static const auto kOriginal = reinterpret_cast<decltype(&recvmsg)>(dlsym(RTLD_NEXT, "recvmsg"));
  const ssize_t count = kOriginal(descriptor, message, flags);
  if (count <= 0 || (flags & (MSG_PEEK | MSG_ERRQUEUE)) != 0) return count;
  if (locus::server::CheckedReads::accept(descriptor, *message, static_cast<size_t>(count))) return count;
  errno = ECONNRESET;
  return -1;
}

extern "C" __attribute__((visibility("default"))) int SSL_do_handshake(SSL* ssl) {
  static const auto kOriginal = reinterpret_cast<decltype(&SSL_do_handshake)>(dlsym(RTLD_NEXT, "SSL_do_handshake"));
  const int result = kOriginal(ssl);
  locus::server::count_handshake(ssl, result);
  return result;
}

extern "C" __attribute__((visibility("default"))) int SSL_read(SSL* ssl, void* buffer, int size) {
  static const auto kOriginal = reinterpret_cast<decltype(&SSL_read)>(dlsym(RTLD_NEXT, "SSL_read"));
  const int count = kOriginal(ssl, buffer, size);
  if (count <= 0) return count;
  const absl::string_view bytes(static_cast<const char*>(buffer), static_cast<size_t>(count));
  return locus::server::accept(ssl, bytes) ? count : -1;
}
