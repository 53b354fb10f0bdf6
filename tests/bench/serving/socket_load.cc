#include "tests/bench/serving/socket_load.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace locus::bench::serving {
namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;
constexpr int kSilenceMs = 60'000;

bool would_block() { return errno == EAGAIN || errno == EINTR; }

template <class Address>
int connected(int family, const Address& address) {
  const int made = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (made >= 0 && connect(made, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return made;
  if (made >= 0) close(made);
  return -1;
}

}  // namespace

int connect_to_port(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(port));
  const int made = connected(AF_INET, address);
  const int at_once = 1;
  if (made >= 0) setsockopt(made, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof(at_once));
  return made;
}

int connect_to_path(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) return -1;
  std::memcpy(address.sun_path, path.c_str(), path.size());
  return connected(AF_UNIX, address);
}

SocketLoad::SocketLoad(int socket, Whole whole) : socket_(socket), whole_(std::move(whole)), buffer_(kBufferBytes) {}

SocketLoad::~SocketLoad() { close(socket_); }

absl::Status SocketLoad::run(size_t window, const Next& next, const Reply& reply) {
  more_ = true;
  while (more_ || under_way_ > 0) {
    const Progress read_some = read(reply);
    const Progress wrote_some = write(window, next);
    if (read_some == Progress::kBroken || wrote_some == Progress::kBroken)
      return absl::UnavailableError("the peer closed the connection");
    const bool idle = read_some == Progress::kNone && wrote_some == Progress::kNone;
    if (idle && (more_ || under_way_ > 0) && !wait()) return absl::UnavailableError("the peer keeps silent");
  }
  return absl::OkStatus();
}

SocketLoad::Progress SocketLoad::write(size_t window, const Next& next) {
  Progress progress = Progress::kNone;
  while (true) {
    if (writing_.empty()) {
      if (!more_ || under_way_ == window) return progress;
      writing_ = next();
      more_ = !writing_.empty();
      if (!more_) return progress;
      ++under_way_;
    }
    const ssize_t written = send(socket_, writing_.data(), writing_.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (written < 0) return would_block() ? progress : Progress::kBroken;
    writing_.remove_prefix(static_cast<size_t>(written));
    progress = Progress::kSome;
  }
}

SocketLoad::Progress SocketLoad::read(const Reply& reply) {
  if (under_way_ == 0) return Progress::kNone;
  if (end_ == buffer_.size()) {
    if (begin_ == 0) buffer_.resize(2 * buffer_.size());
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  const ssize_t received = recv(socket_, buffer_.data() + end_, buffer_.size() - end_, MSG_DONTWAIT);
  if (received == 0) return Progress::kBroken;
  if (received < 0) return would_block() ? Progress::kNone : Progress::kBroken;
  end_ += static_cast<size_t>(received);
  while (begin_ < end_) {
    const absl::string_view rest(buffer_.data() + begin_, end_ - begin_);
    const size_t bytes = whole_(rest);
    if (bytes == 0) break;
    reply(rest.substr(0, bytes));
    begin_ += bytes;
    --under_way_;
  }
  if (begin_ == end_) begin_ = end_ = 0;
  return Progress::kSome;
}

bool SocketLoad::wait() const {
  pollfd wanted{socket_, POLLIN, 0};
  if (!writing_.empty()) wanted.events |= POLLOUT;
  const int ready = poll(&wanted, 1, kSilenceMs);
  return ready > 0 || (ready < 0 && errno == EINTR);
}

}  // namespace locus::bench::serving
