// TLS of the HTTP port: the settings of OpenSSL for the newest certificates. For http_server.cc only.
//
// Threads: every member may be called from any thread.
#ifndef LOCUS_SERVER_OBSERVABILITY_HTTP_TLS_H_
#define LOCUS_SERVER_OBSERVABILITY_HTTP_TLS_H_

#include <boost/asio/ssl/context.hpp>
#include <functional>
#include <memory>
#include <utility>

#include "core/base/mutex.h"
#include "server/security/tls_files.h"

namespace locus::server {

class HttpTls {
 public:
  // `certificates` returns contents that check_tls_contents() accepts.
  explicit HttpTls(std::function<TlsContents()> certificates) : certificates_(std::move(certificates)) {}

  // Returns the settings for a new connection: TLS 1.2 and 1.3, and a required client certificate if there is a client
  // CA. The settings are made again after the certificates have changed. Returns null if OpenSSL refuses the
  // certificates.
  std::shared_ptr<boost::asio::ssl::context> context() LOCUS_EXCLUDES(mutex_);

 private:
  const std::function<TlsContents()> certificates_;
  Mutex mutex_;
  TlsContents contents_ LOCUS_GUARDED_BY(mutex_);
  std::shared_ptr<boost::asio::ssl::context> context_ LOCUS_GUARDED_BY(mutex_);  // for contents_; null at first
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_HTTP_TLS_H_
