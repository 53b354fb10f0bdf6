#include "tests/bench/serving/raw_tcp.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

#include "tests/bench/serving/threads.h"

namespace locus::bench::serving {
namespace {

constexpr int kWaiting = 16;

bool read_all(int socket, char* to, size_t bytes) {
  while (bytes > 0) {
    const ssize_t read = recv(socket, to, bytes, MSG_WAITALL);
    if (read <= 0) return false;
    to += read;
    bytes -= static_cast<size_t>(read);
  }
  return true;
}

bool write_all(int socket, const char* from, size_t bytes) {
  while (bytes > 0) {
    const ssize_t written = send(socket, from, bytes, MSG_NOSIGNAL);
    if (written <= 0) return false;
    from += written;
    bytes -= static_cast<size_t>(written);
  }
  return true;
}

void answer(int socket) {
  const int at_once = 1;
  setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof(at_once));
  MessageBytes bytes;
  if (read_all(socket, reinterpret_cast<char*>(&bytes), sizeof(bytes))) {
    std::vector<char> message(std::max(bytes.request, bytes.reply));
    while (read_all(socket, message.data(), bytes.request) && write_all(socket, message.data(), bytes.reply)) {
    }
  }
  close(socket);
}

[[noreturn]] void serve(int listener, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  while (getppid() == parent) {
    const int socket = accept(listener, nullptr, nullptr);
    if (socket >= 0) std::thread(answer, socket).detach();
  }
  _exit(0);
}

// Returns a listening socket on a free port of the loopback and sets `port`; returns -1 on failure.
int listen_on_free_port(int& port) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  const bool listens = listener >= 0 && bind(listener, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                       listen(listener, kWaiting) == 0 &&
                       getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  if (!listens && listener >= 0) close(listener);
  port = ntohs(address.sin_port);
  return listens ? listener : -1;
}

}  // namespace

absl::StatusOr<std::unique_ptr<RawTcpServer>> RawTcpServer::start() {
  int port = 0;
  const int listener = listen_on_free_port(port);
  if (listener < 0) return absl::UnavailableError("cannot listen on the loopback");
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) serve(listener, parent);
  close(listener);
  if (pid < 0) return absl::UnavailableError("cannot start another process");
  return std::unique_ptr<RawTcpServer>(new RawTcpServer(pid, port));
}

RawTcpServer::~RawTcpServer() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

RawTcpLoad::RawTcpLoad(const RawTcpServer& server, const MessageBytes& bytes, size_t connections, size_t window)
    : window_(window), message_(bytes.request, 'x') {
  for (size_t i = 0; i < connections; ++i) {
    const int socket = connect_to_port(server.port());
    const bool stands = socket >= 0 && write_all(socket, reinterpret_cast<const char*>(&bytes), sizeof(bytes));
    if (!stands) status_.Update(absl::UnavailableError("the echo over plain sockets does not answer"));
    const size_t reply = bytes.reply;
    connections_.push_back(std::make_unique<SocketLoad>(
        socket, [reply](absl::string_view received) { return received.size() < reply ? 0 : reply; }));
  }
}

void RawTcpLoad::run(size_t messages) {
  Turns turns(messages);
  std::vector<absl::Status> ends(connections_.size());
  on_threads(connections_.size(), [&](size_t i) {
    const auto next = [&] { return turns.take() ? absl::string_view(message_) : absl::string_view(); };
    ends[i] = connections_[i]->run(window_, next, [](absl::string_view) {});
  });
  for (const absl::Status& end : ends) status_.Update(end);
}

}  // namespace locus::bench::serving
