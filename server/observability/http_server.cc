#include "server/observability/http_server.h"

#include <civetweb.h>

#include <array>
#include <chrono>
#include <future>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/base/check.h"
#include "server/config/observability_limits.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

// Initialises civetweb for the lifetime of this object. Several objects may exist, because civetweb counts its
// initialisations.
class Library {
 public:
  Library() { mg_init_library(MG_FEATURES_DEFAULT); }
  ~Library() { mg_exit_library(); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
};

bool is_head(const mg_request_info& request) { return absl::string_view(request.request_method) == "HEAD"; }

HttpReply reply_to(const mg_request_info& request, const HttpServer::Pages& pages) {
  if (!is_head(request) && absl::string_view(request.request_method) != "GET")
    return {.code = 405, .body = "only GET and HEAD are answered here\n"};
  const char* path = request.local_uri;
  const auto page = pages.find(path == nullptr ? "" : path);
  if (page != pages.end()) return page->second();
  HttpReply reply{.code = 404, .body = "no such page; there are:\n"};
  for (const auto& [name, make] : pages) absl::StrAppend(&reply.body, name, "\n");
  return reply;
}

// Answers every request, whatever its path, so that civetweb itself serves nothing.
int answer(mg_connection* connection) {
  const mg_request_info& request = *mg_get_request_info(connection);
  const HttpReply reply = reply_to(request, *static_cast<const HttpServer::Pages*>(request.user_data));
  mg_response_header_start(connection, reply.code);
  mg_response_header_add(connection, "Content-Type", reply.content_type.c_str(), -1);
  mg_response_header_add(connection, "Content-Length", absl::StrCat(reply.body.size()).c_str(), -1);
  mg_response_header_add(connection, "Cache-Control", "no-store", -1);
  mg_response_header_add(connection, "X-Content-Type-Options", "nosniff", -1);
  if (reply.code == 405) mg_response_header_add(connection, "Allow", "GET, HEAD", -1);
  mg_response_header_add(connection, "Connection", "close", -1);
  mg_response_header_send(connection);
  if (!is_head(request)) mg_write(connection, reply.body.data(), reply.body.size());
  return reply.code;
}

int log_message(const mg_connection*, const char* message) {
  log(LogLevel::kDebug, "http", {{"text", message}});
  return 1;
}

}  // namespace

struct HttpServer::Context {
  ~Context() {
    if (running != nullptr) stop();
  }

  // Ends civetweb's threads. They check whether they must end only every two seconds and after each connection, so this
  // opens connections until all threads have ended.
  void stop() {
    const std::future<void> stopped = std::async(std::launch::async, mg_stop, running);
    while (stopped.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) {
      std::array<char, 64> error{};
      mg_connection* connection = mg_connect_client(host.c_str(), port, 0, error.data(), error.size());
      if (connection != nullptr) mg_close_connection(connection);
    }
  }

  Library library;
  mg_callbacks callbacks{};
  mg_context* running = nullptr;
  std::string host;
  int port = 0;
};

HttpServer::HttpServer(Pages pages) : pages_(std::move(pages)), context_(std::make_unique<Context>()) {
  context_->callbacks.begin_request = answer;
  context_->callbacks.log_message = log_message;
}

HttpServer::~HttpServer() = default;

absl::StatusOr<std::unique_ptr<HttpServer>> HttpServer::start(const ListenAddress& address, Pages pages) {
  LOCUS_DCHECK(address.kind == ListenAddress::Kind::kTcp);
  std::unique_ptr<HttpServer> server(new HttpServer(std::move(pages)));
  const std::vector<std::pair<const char*, std::string>> settings = {
      {"listening_ports", to_string(address, address.port)},
      {"num_threads", absl::StrCat(kHttpThreads)},
      {"connection_queue", absl::StrCat(kMaxHttpWaiting)},
      {"listen_backlog", absl::StrCat(kMaxHttpWaiting)},
      {"max_request_size", absl::StrCat(kMaxHttpRequestBytes)},
      {"request_timeout_ms", absl::StrCat(kHttpTimeoutMs)},
      {"enable_keep_alive", "no"},
      {"enable_directory_listing", "no"}};
  std::vector<const char*> options;
  for (const auto& [name, value] : settings) options.insert(options.end(), {name, value.c_str()});
  options.push_back(nullptr);
  std::array<char, 256> text{};
  unsigned code = 0;
  mg_error_data error{&code, text.data(), text.size()};
  // civetweb takes a pointer to non-const user data; answer() only reads it.
  mg_init_data init{&server->context_->callbacks, const_cast<Pages*>(&server->pages_), options.data()};
  server->context_->running = mg_start2(&init, &error);
  if (server->context_->running == nullptr) return absl::UnavailableError(text.data());
  mg_server_port port{};
  mg_get_server_ports(server->context_->running, 1, &port);
  server->context_->host = address.host;
  server->context_->port = port.port;
  server->port_ = static_cast<uint16_t>(port.port);
  return server;
}

}  // namespace locus::server
