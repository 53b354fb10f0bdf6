// The daemon's HTTP port: a fixed set of pages without parameters, for scrapers and probes, over TLS if there are
// certificates. Boost.Beast implements HTTP and OpenSSL implements TLS; no file, form, script or socket upgrade is
// served.
//
// The server's resources are bounded: observability_limits.h defines how many connections are served at a time, the
// maximum size of a request, and the timeouts. Further connections wait in the kernel. Each connection serves one
// request. Only GET and HEAD are served; other methods are answered with 405 and unknown paths with 404.
//
// Threads: the page functions and the function that returns certificates are called on threads of the HTTP server,
// possibly by several threads at the same time.
#ifndef LOCUS_SERVER_OBSERVABILITY_HTTP_SERVER_H_
#define LOCUS_SERVER_OBSERVABILITY_HTTP_SERVER_H_

#include <cstdint>
#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "server/config/listen_address.h"
#include "server/observability/http_page.h"
#include "server/security/tls_files.h"

namespace locus::server {

class HttpServer {
 public:
  // Function that returns the checked certificates that new connections use; an empty function means no TLS. If the
  // function returns a client CA, too, only clients with a certificate signed by that CA are served.
  using Certificates = std::function<TlsContents()>;

  // Starts serving. `address` must be a TCP address. Returns UNAVAILABLE if the server cannot listen on it.
  static absl::StatusOr<std::unique_ptr<HttpServer>> start(const ListenAddress& address, HttpPages pages,
                                                           Certificates certificates = {});
  // Ends the server as soon as all page functions in progress have returned.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  // Returns the bound port, also if the address has port 0.
  uint16_t port() const { return port_; }

 private:
  class Parts;
  HttpServer(std::unique_ptr<Parts> parts, uint16_t port);

  std::unique_ptr<Parts> parts_;
  const uint16_t port_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_HTTP_SERVER_H_
