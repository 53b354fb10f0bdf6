#include "server/rpc/listening.h"

#include <netdb.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "absl/strings/str_cat.h"

namespace locus::server {
namespace {

class Socket {
 public:
  explicit Socket(int family) : fd_(socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (fd_ >= 0) close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

sockaddr_un unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  return address;
}

std::string why_not_unix(const std::string& path) {
  const std::string folder = path.substr(0, path.rfind('/') + 1);
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    return absl::StrCat("no socket can be made in ", folder, ": ", std::strerror(errno));
  return "the path is taken by something that is not a socket, or cannot be used";
}

}  // namespace

absl::Status check_free(const ListenAddress& address) {
  if (address.kind != ListenAddress::Kind::kUnix) return absl::OkStatus();
  const Socket probe(AF_UNIX);
  const sockaddr_un name = unix_address(address.path);
  if (connect(probe.fd(), reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0) return absl::OkStatus();
  return absl::AlreadyExistsError("another process answers there; end it first or choose another path");
}

std::string why_not(const ListenAddress& address) {
  if (address.kind == ListenAddress::Kind::kUnix) return why_not_unix(address.path);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(address.host.c_str(), absl::StrCat(address.port).c_str(), &hints, &found);
      error != 0)
    return absl::StrCat("the host is not known: ", gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, &freeaddrinfo);
  for (const addrinfo* entry = found; entry != nullptr; entry = entry->ai_next) {
    const Socket probe(entry->ai_family);
    const int on = 1;
    setsockopt(probe.fd(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(probe.fd(), entry->ai_addr, entry->ai_addrlen) == 0) continue;
    const bool used = errno == EADDRINUSE;
    return absl::StrCat(std::strerror(errno), used ? "; another server runs there: end it or choose another port" : "");
  }
  return "the system gives no reason";
}

}  // namespace locus::server
