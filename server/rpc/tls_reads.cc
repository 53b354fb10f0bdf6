#include "server/rpc/tls_reads.h"

#include <dlfcn.h>

#include <atomic>
#include <chrono>
#include <memory>

#include "core/base/check.h"
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

// Returns whether `name` is a function of the program that contains this code, and not of another library.
bool is_replaced(const char* name) {
  Dl_info theirs{}, ours{};
  void* const found = dlsym(RTLD_DEFAULT, name);
  return found != nullptr && dladdr(found, &theirs) != 0 &&
         dladdr(reinterpret_cast<const void*>(&tls_counts), &ours) != 0 && theirs.dli_fbase == ours.dli_fbase;
}

}  // namespace

TlsCounts tls_counts() { return {failed_handshakes.load(), long_headers.load(), floods.load()}; }

void check_tls_reads(OnRefused on_refused) {
  // Check that gRPC will call our functions. It would call the original ones if read_hooks.cc were not linked or if,
  // for example, gRPC were linked statically.
  for (const char* name : {"recvmsg", "SSL_read", "SSL_do_handshake"}) LOCUS_CHECK(is_replaced(name));
  static const TlsChecks kChecks{on_refused, SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, free_check)};
  tls_checks.store(&kChecks);
}

bool accept_tls_read(SSL* ssl, absl::string_view bytes) {
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

void count_handshake(SSL* ssl, int result) {
  if (result > 0 || SSL_is_server(ssl) == 0) return;
  const int error = SSL_get_error(ssl, result);
  if (error != SSL_ERROR_WANT_READ && error != SSL_ERROR_WANT_WRITE) failed_handshakes.fetch_add(1);
}

}  // namespace locus::server
