// Pages of the HTTP port: the argument and the result of a page function. Plain data.
#ifndef LOCUS_SERVER_OBSERVABILITY_HTTP_PAGE_H_
#define LOCUS_SERVER_OBSERVABILITY_HTTP_PAGE_H_

#include <functional>
#include <map>
#include <string>

namespace locus::server {

// Reader of a page, as a page function sees it. The reader chooses `authorization`, which is not verified; the other
// members come from the connection.
struct HttpRequest {
  std::string peer;              // Peer::label of the connection: address and port of the reader
  std::string address;           // limit key of the reader's address; see connection.h
  std::string authorization;     // value of the header `authorization`; empty = none
  std::string certificate_name;  // see certificate_name.h; empty = no certificate
};

// Reply to a request. If the code is 401, the server adds the header `WWW-Authenticate: Bearer`.
struct HttpReply {
  int code = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
};

// Map from the path of a page, such as "/metrics", to the function that makes the page.
using HttpPages = std::map<std::string, std::function<HttpReply(const HttpRequest&)>, std::less<>>;

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_HTTP_PAGE_H_
