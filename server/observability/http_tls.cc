#include "server/observability/http_tls.h"

#include <openssl/ssl.h>

#include <boost/asio/buffer.hpp>
#include <string>

namespace locus::server {
namespace {

namespace ssl = boost::asio::ssl;
using boost::system::error_code;

// Returns the settings for `contents`; null if OpenSSL refuses a certificate or the key.
std::shared_ptr<ssl::context> make_context(const TlsContents& contents) {
  auto made = std::make_shared<ssl::context>(ssl::context::tls_server);
  SSL_CTX* const native = made->native_handle();
  const auto buffer = [](const std::string& text) { return boost::asio::buffer(text.data(), text.size()); };
  bool good = SSL_CTX_set_min_proto_version(native, TLS1_2_VERSION) == 1;
  // Do not resume sessions: a resumed session would accept a certificate that was verified before the client CA
  // changed.
  SSL_CTX_set_session_cache_mode(native, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(native, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION);
  error_code error;
  made->use_certificate_chain(buffer(contents.certificate), error);
  good = good && !error;
  made->use_private_key(buffer(contents.key), ssl::context::pem, error);
  good = good && !error;
  if (!contents.client_ca.empty()) {
    made->add_certificate_authority(buffer(contents.client_ca), error);
    good = good && !error;
    made->set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert, error);
    good = good && !error;
  }
  return good ? made : nullptr;
}

}  // namespace

std::shared_ptr<ssl::context> HttpTls::context() {
  TlsContents contents = certificates_();
  const MutexLock lock(mutex_);
  if (context_ == nullptr || contents != contents_) {
    context_ = make_context(contents);
    contents_ = std::move(contents);
  }
  return context_;
}

}  // namespace locus::server
