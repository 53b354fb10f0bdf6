#include "server/observability/http_session.h"

#include <openssl/ssl.h>

#include <boost/asio/dispatch.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "server/config/observability_limits.h"
#include "server/connections/connection.h"
#include "server/security/certificate_name.h"

namespace locus::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using asio::ip::tcp;
using PlainStream = beast::tcp_stream;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;
using Request = http::request<http::empty_body>;

std::string_view to_std(beast::string_view text) { return {text.data(), text.size()}; }

HttpReply reply_to(const Request& request, const HttpRequest& reader, const HttpPages& pages) {
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return {.code = 405, .body = "only GET and HEAD are answered here\n"};
  const std::string_view target = to_std(request.target());
  const auto page = pages.find(target.substr(0, target.find('?')));
  if (page != pages.end()) return page->second(reader);
  HttpReply reply{.code = 404, .body = "no such page; there are:\n"};
  for (const auto& [name, make] : pages) absl::StrAppend(&reply.body, name, "\n");
  return reply;
}

// Returns the reply to bytes that are not a valid request; nullopt if no reply is due, because no complete request was
// received.
std::optional<HttpReply> reply_to_mistake(const beast::error_code& error) {
  const bool long_header = error == http::error::header_limit || error == http::error::buffer_overflow;
  if (long_header) return HttpReply{.code = 431, .body = absl::StrCat("more than ", kMaxHttpRequestBytes, " bytes\n")};
  const bool no_request = error == http::error::end_of_stream || error == http::error::partial_message ||
                          error.category() != make_error_code(http::error::bad_method).category();
  if (no_request) return std::nullopt;
  return HttpReply{.code = 400, .body = "this is no HTTP request\n"};
}

http::response<http::string_body> response_of(const Request& request, HttpReply reply) {
  http::response<http::string_body> response(static_cast<http::status>(reply.code), 11);
  response.set(http::field::content_type, reply.content_type);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  if (reply.code == 401) response.set(http::field::www_authenticate, "Bearer");
  if (reply.code == 405) response.set(http::field::allow, "GET, HEAD");
  response.keep_alive(false);
  response.body() = std::move(reply.body);
  response.prepare_payload();
  if (request.method() == http::verb::head) response.body().clear();  // the header keeps the length of the body
  return response;
}

std::string certificate_name_of(PlainStream&) { return {}; }

std::string certificate_name_of(TlsStream& stream) {
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(SSL_get1_peer_certificate(stream.native_handle()),
                                                                X509_free);
  if (certificate == nullptr || SSL_get_verify_result(stream.native_handle()) != X509_V_OK) return {};
  return certificate_name(*certificate);
}

// One connection. The handler of each pending operation shares ownership of the session, so the session is destroyed
// with the last handler. All handlers run on the stream's strand.
template <class Stream>
class HttpSession : public std::enable_shared_from_this<HttpSession<Stream>> {
 public:
  HttpSession(Stream stream, std::shared_ptr<asio::ssl::context> tls, const HttpPages& pages,
              std::function<void()> ended)
      : tls_(std::move(tls)), stream_(std::move(stream)), pages_(pages), ended_(std::move(ended)) {
    parser_.header_limit(kMaxHttpRequestBytes);
  }

  void start() {
    asio::dispatch(stream_.get_executor(), [self = this->shared_from_this()] { self->begin(); });
  }

 private:
  void begin() {
    limit_time();
    if constexpr (std::is_same_v<Stream, TlsStream>) {
      stream_.async_handshake(asio::ssl::stream_base::server,
                              [self = this->shared_from_this()](const beast::error_code& error) {
                                if (!error) return self->read();
                                self->ended_();
                              });
    } else {
      read();
    }
  }

  // Sets the deadline of the connection's next operations to kHttpTimeoutMs from now.
  void limit_time() { beast::get_lowest_layer(stream_).expires_after(std::chrono::milliseconds(kHttpTimeoutMs)); }

  void read() {
    http::async_read_header(
        stream_, buffer_, parser_,
        [self = this->shared_from_this()](const beast::error_code& error, size_t) { self->answer(error); });
  }

  void answer(const beast::error_code& error) {
    std::optional<HttpReply> reply;
    if (error) {
      reply = reply_to_mistake(error);
      if (!reply) return ended_();
    } else {
      reply = reply_to(parser_.get(), reader(), pages_);
    }
    response_ = response_of(parser_.get(), *std::move(reply));
    limit_time();
    http::async_write(stream_, response_, [self = this->shared_from_this()](const beast::error_code& failed, size_t) {
      if (!failed) return self->finish();
      self->ended_();
    });
  }

  // Ends the connection in such a way that the reader gets the whole reply.
  void finish() {
    if constexpr (std::is_same_v<Stream, TlsStream>) {
      stream_.async_shutdown([self = this->shared_from_this()](const beast::error_code&) { self->ended_(); });
    } else {
      beast::error_code ignored;
      stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
      ended_();
    }
  }

  HttpRequest reader() {
    HttpRequest reader;
    if (const std::optional<Peer> peer = peer_of(beast::get_lowest_layer(stream_).socket().native_handle())) {
      reader.peer = peer->label;
      reader.address = peer->limit_key;
    }
    reader.authorization = std::string(to_std(parser_.get()[http::field::authorization]));
    reader.certificate_name = certificate_name_of(stream_);
    return reader;
  }

  const std::shared_ptr<asio::ssl::context> tls_;  // outlives the stream, which uses it; null without TLS
  Stream stream_;
  const HttpPages& pages_;
  const std::function<void()> ended_;
  beast::flat_buffer buffer_{kMaxHttpRequestBytes + 1};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

void serve_http(tcp::socket socket, HttpTls* tls, const HttpPages& pages, std::function<void()> ended) {
  if (tls == nullptr) {
    std::make_shared<HttpSession<PlainStream>>(PlainStream(std::move(socket)), nullptr, pages, std::move(ended))
        ->start();
    return;
  }
  std::shared_ptr<asio::ssl::context> context = tls->context();
  if (context == nullptr) return ended();
  TlsStream stream(PlainStream(std::move(socket)), *context);
  std::make_shared<HttpSession<TlsStream>>(std::move(stream), std::move(context), pages, std::move(ended))->start();
}

}  // namespace locus::server
