// The daemon's HTTP port: a fixed set of pages without parameters, for scrapers and probes. The only place that knows
// civetweb, of which nothing is used but the reading of requests: no file, form, script or socket upgrade is served.
//
// Bounded: observability_limits.h says how many connections are answered and wait, how long a request may be and how
// long it may take; a connection carries one request. Only GET and HEAD are answered, other methods with 405 and other
// paths with 404.
//
// Threads: pages are made on threads of the server's own, several at once.
#ifndef LOCUS_SERVER_OBSERVABILITY_HTTP_SERVER_H_
#define LOCUS_SERVER_OBSERVABILITY_HTTP_SERVER_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/config/listen_address.h"

namespace locus::server {

struct HttpReply {
  int code = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
};

class HttpServer {
 public:
  // By path, such as "/metrics".
  using Pages = std::map<std::string, std::function<HttpReply()>>;

  // Serves from now on. `address` is a TCP one. UNAVAILABLE where it cannot be listened on.
  static absl::StatusOr<std::unique_ptr<HttpServer>> start(const ListenAddress& address, Pages pages);
  // Ends at once; waits for pages in work.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  // The one in use where the address asked for any.
  uint16_t port() const { return port_; }

 private:
  struct Context;
  explicit HttpServer(Pages pages);

  const Pages pages_;
  std::unique_ptr<Context> context_;
  uint16_t port_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_HTTP_SERVER_H_
