#include "server/observability/http_server.h"

#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/config/observability_limits.h"
#include "server/connections/listening_socket.h"
#include "server/observability/http_session.h"
#include "server/observability/http_tls.h"

namespace locus::server {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

// Pause after accept() has failed, for example because the process has no free descriptor.
constexpr std::chrono::milliseconds kAcceptPause{100};

tcp protocol_of(int descriptor) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  const bool known = ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  return known && address.ss_family == AF_INET6 ? tcp::v6() : tcp::v4();
}

// Accepts and serves connections of a listening socket, at most `max_connections` at a time: when one ends, the next is
// accepted. The operations on the socket run one at a time, on its strand. `socket` must outlive the listener.
class HttpListener {
 public:
  HttpListener(asio::io_context& io, const ListeningSocket& socket, const HttpPages& pages, HttpTls* tls,
               size_t max_connections)
      : io_(io), strand_(asio::make_strand(io)), acceptor_(io), pages_(pages), tls_(tls) {
    error_code error;
    acceptor_.assign(protocol_of(socket.descriptor()), socket.descriptor(), error);
    LOCUS_CHECK(!error);  // the descriptor is open and listens
    for (size_t i = 0; i < max_connections; ++i) accept_next();
  }
  ~HttpListener() {
    error_code ignored;
    acceptor_.release(ignored);  // `socket` closes the descriptor
  }
  HttpListener(const HttpListener&) = delete;
  HttpListener& operator=(const HttpListener&) = delete;

 private:
  void accept_next() {
    asio::dispatch(strand_, [this] {
      acceptor_.async_accept(asio::make_strand(io_), [this](const error_code& error, tcp::socket socket) {
        accepted(error, std::move(socket));
      });
    });
  }

  void accepted(const error_code& error, tcp::socket socket) {
    if (!error) return serve_http(std::move(socket), tls_, pages_, [this] { accept_next(); });
    const auto timer = std::make_shared<asio::steady_timer>(io_, kAcceptPause);
    timer->async_wait([this, timer](const error_code& stopped) {
      if (!stopped) accept_next();
    });
  }

  asio::io_context& io_;
  asio::strand<asio::io_context::executor_type> strand_;
  tcp::acceptor acceptor_;
  const HttpPages& pages_;
  HttpTls* const tls_;  // null without TLS
};

}  // namespace

class HttpServer::Parts {
 public:
  Parts(std::vector<ListeningSocket> sockets, HttpPages pages, Certificates certificates)
      : sockets_(std::move(sockets)), pages_(std::move(pages)) {
    if (certificates) tls_ = std::make_unique<HttpTls>(std::move(certificates));
    // A name such as localhost may have two addresses, and so two sockets, which share the limit.
    const size_t share = std::max<size_t>(1, kMaxHttpConnections / sockets_.size());
    for (const ListeningSocket& socket : sockets_)
      listeners_.push_back(std::make_unique<HttpListener>(io_, socket, pages_, tls_.get(), share));
    for (uint32_t i = 0; i < kHttpThreads; ++i) threads_.emplace_back([this] { io_.run(); });
  }
  ~Parts() {
    io_.stop();
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  const std::vector<ListeningSocket> sockets_;
  const HttpPages pages_;
  std::unique_ptr<HttpTls> tls_;
  asio::io_context io_;
  std::vector<std::unique_ptr<HttpListener>> listeners_;
  std::vector<std::thread> threads_;
};

HttpServer::HttpServer(std::unique_ptr<Parts> parts, uint16_t port) : parts_(std::move(parts)), port_(port) {}

HttpServer::~HttpServer() = default;

absl::StatusOr<std::unique_ptr<HttpServer>> HttpServer::start(const ListenAddress& address, HttpPages pages,
                                                              Certificates certificates) {
  LOCUS_DCHECK(address.kind == ListenAddress::Kind::kTcp);
  ASSIGN_OR_RETURN(std::vector<ListeningSocket> sockets, listen_on(address, {}));
  const uint16_t port = sockets.front().port();
  auto parts = std::make_unique<Parts>(std::move(sockets), std::move(pages), std::move(certificates));
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(parts), port));
}

}  // namespace locus::server
