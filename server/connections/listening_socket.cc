#include "server/connections/listening_socket.h"

#include <fcntl.h>
#include <grp.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

constexpr int kBacklog = 1024;

absl::Status unusable(absl::string_view why) { return absl::UnavailableError(why); }
absl::Status unusable_by_errno(absl::string_view what) { return unusable(absl::StrCat(what, std::strerror(errno))); }

sockaddr_un unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  return address;
}

// Removes the socket file that an ended process left at `path`. Returns ALREADY_EXISTS if a process answers there.
absl::Status remove_stale(const std::string& path) {
  struct stat file {};
  if (lstat(path.c_str(), &file) != 0) return absl::OkStatus();
  if (!S_ISSOCK(file.st_mode)) return unusable("the path is taken by something that is not a socket");
  const ListeningSocket probe(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const sockaddr_un name = unix_address(path);
  if (connect(probe.descriptor(), reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0 || errno == EAGAIN)
    return absl::AlreadyExistsError("another process answers there; end it first or choose another path");
  if (errno != ECONNREFUSED) return unusable_by_errno("whether a process answers there cannot be found out: ");
  if (unlink(path.c_str()) != 0) return unusable_by_errno("the socket of an ended process cannot be removed: ");
  return absl::OkStatus();
}

struct Owner {
  uid_t user = static_cast<uid_t>(-1);  // -1 = unchanged
  gid_t group = static_cast<gid_t>(-1);
};

// Returns the ids of the names in `text`: `user`, `user:group` or `:group`. A name that is missing keeps the id -1.
absl::StatusOr<Owner> find_owner(const std::string& text) {
  Owner owner;
  const size_t colon = text.find(':');
  const std::string user = text.substr(0, colon);
  if (!user.empty() && !absl::SimpleAtoi(user, &owner.user)) {
    const passwd* found = getpwnam(user.c_str());
    if (found == nullptr) return unusable(absl::StrCat("--unix-owner names the user ", user, ", who does not exist"));
    owner.user = found->pw_uid;
  }
  const std::string group = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (!group.empty() && !absl::SimpleAtoi(group, &owner.group)) {
    const ::group* found = getgrnam(group.c_str());
    if (found == nullptr)
      return unusable(absl::StrCat("--unix-owner names the group ", group, ", which does not exist"));
    owner.group = found->gr_gid;
  }
  return owner;
}

absl::Status bind_unix(int descriptor, const std::string& path, const UnixAccess& access) {
  ASSIGN_OR_RETURN(const Owner owner, find_owner(access.owner));
  RETURN_IF_ERROR(remove_stale(path));
  const sockaddr_un name = unix_address(path);
  if (bind(descriptor, reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0)
    return unusable_by_errno(absl::StrCat("no socket can be made in ", path.substr(0, path.rfind('/') + 1), ": "));
  // The socket does not listen before its owner and permissions are set, so nobody can connect too early.
  if (chmod(path.c_str(), static_cast<mode_t>(access.mode)) != 0 ||
      (!access.owner.empty() && lchown(path.c_str(), owner.user, owner.group) != 0)) {
    const int error = errno;
    unlink(path.c_str());
    return unusable(absl::StrCat("its owner or permissions cannot be set: ", std::strerror(error)));
  }
  return absl::OkStatus();
}

void set_flag(int descriptor, int level, int option, int value) {
  setsockopt(descriptor, level, option, &value, sizeof value);
}

// Binds and listens on one address of a host. Accepted sockets inherit the options that are set here. Returns 0, or the
// system's error number.
int listen_tcp(const addrinfo& address, ListeningSocket& listening) {
  listening = ListeningSocket(socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int descriptor = listening.descriptor();
  if (descriptor < 0) return errno;
  set_flag(descriptor, SOL_SOCKET, SO_REUSEADDR, 1);
  set_flag(descriptor, IPPROTO_TCP, TCP_NODELAY, 1);
  if (address.ai_family == AF_INET6) set_flag(descriptor, IPPROTO_IPV6, IPV6_V6ONLY, 0);
  const bool bound = bind(descriptor, address.ai_addr, address.ai_addrlen) == 0;
  return bound && listen(descriptor, kBacklog) == 0 ? 0 : errno;
}

absl::Status listen_error(int error) {
  const bool used = error == EADDRINUSE;
  return unusable(
      absl::StrCat(std::strerror(error), used ? "; another server runs there: end it or choose another port" : ""));
}

absl::StatusOr<std::vector<ListeningSocket>> listen_on_host(const ListenAddress& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(address.host.c_str(), absl::StrCat(address.port).c_str(), &hints, &found);
      error != 0)
    return unusable(absl::StrCat("the host is not known: ", gai_strerror(error)));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, &freeaddrinfo);
  std::vector<ListeningSocket> sockets;
  absl::Status failure = unusable("the host has no address");
  for (const addrinfo* entry = found; entry != nullptr; entry = entry->ai_next) {
    if (address.port == 0 && !sockets.empty()) {
      // sockaddr_in and sockaddr_in6 have the port at the same offset.
      auto* port_holder = reinterpret_cast<sockaddr_in*>(entry->ai_addr);
      port_holder->sin_port = htons(sockets.front().port());
    }
    ListeningSocket listening(-1);
    const int error = listen_tcp(*entry, listening);
    if (error == 0) {
      sockets.push_back(std::move(listening));
      continue;
    }
    failure = listen_error(error);
    // Skip addresses that this machine does not have: a host name can have an IPv6 address on a machine without IPv6.
    if (error != EADDRNOTAVAIL && error != EAFNOSUPPORT) return failure;
  }
  if (sockets.empty()) return failure;
  return sockets;
}

}  // namespace

ListeningSocket& ListeningSocket::operator=(ListeningSocket&& other) noexcept {
  if (this == &other) return *this;
  close();
  descriptor_ = std::exchange(other.descriptor_, -1);
  path_ = std::exchange(other.path_, std::string());
  device_ = other.device_;
  inode_ = other.inode_;
  return *this;
}

uint16_t ListeningSocket::port() const {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  if (local() || getsockname(descriptor_, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return 0;
  return ntohs(reinterpret_cast<const sockaddr_in&>(storage).sin_port);
}

void ListeningSocket::close() {
  if (descriptor_ < 0) return;
  struct stat file {};
  const bool ours =
      !path_.empty() && lstat(path_.c_str(), &file) == 0 && file.st_dev == device_ && file.st_ino == inode_;
  if (ours) unlink(path_.c_str());
  ::close(descriptor_);
  descriptor_ = -1;
}

absl::StatusOr<std::vector<ListeningSocket>> listen_on(const ListenAddress& address, const UnixAccess& unix_access) {
  if (address.kind == ListenAddress::Kind::kTcp) return listen_on_host(address);
  ListeningSocket listening(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  RETURN_IF_ERROR(bind_unix(listening.descriptor(), address.path, unix_access));
  struct stat file {};
  if (lstat(address.path.c_str(), &file) != 0 || listen(listening.descriptor(), kBacklog) != 0)
    return unusable_by_errno("");
  listening.path_ = address.path;
  listening.device_ = file.st_dev;
  listening.inode_ = file.st_ino;
  std::vector<ListeningSocket> sockets;
  sockets.push_back(std::move(listening));
  return sockets;
}

}  // namespace locus::server
