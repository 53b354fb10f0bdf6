// The daemon's HTTP port: a fixed set of pages without parameters, for scrapers and probes. The only place that
// includes civetweb, which is used for parsing requests only: no file, form, script or socket upgrade is served.
//
// Bounded: observability_limits.h has the maximum number of connections that are answered and that wait, the maximum
// size of a request and its timeout; a connection carries one request. Only GET and HEAD are served; other methods are
// answered with 405 and other paths with 404.
//
// Threads: the page functions are called on threads of the HTTP server, several at once.
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
  // Functions that make the pages, by path, such as "/metrics".
  using Pages = std::map<std::string, std::function<HttpReply()>>;

  // Starts serving. `address` must be a TCP address. Returns UNAVAILABLE if it cannot be listened on.
  static absl::StatusOr<std::unique_ptr<HttpServer>> start(const ListenAddress& address, Pages pages);
  // Ends the server at once, after waiting for pages that are being made.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  // Returns the bound port, also if the address asked for any.
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
