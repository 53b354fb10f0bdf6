// Serves one connection of the HTTP port: the TLS handshake if TLS is on, one request and its reply. For http_server.cc
// only.
#ifndef LOCUS_SERVER_OBSERVABILITY_HTTP_SESSION_H_
#define LOCUS_SERVER_OBSERVABILITY_HTTP_SESSION_H_

#include <boost/asio/ip/tcp.hpp>
#include <functional>
#include <utility>

#include "server/observability/http_page.h"
#include "server/observability/http_tls.h"

namespace locus::server {

// Serves a connection on threads of the socket's io_context. `socket` must have a strand of its own. Calls `ended`
// once, on one of these threads, unless the io_context stops before. `tls` is null without TLS. `pages` and `tls` must
// outlive the threads.
void serve_http(boost::asio::ip::tcp::socket socket, HttpTls* tls, const HttpPages& pages, std::function<void()> ended);

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_HTTP_SESSION_H_
