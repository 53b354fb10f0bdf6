#include "server/connections/connection.h"

#include <arpa/inet.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace locus::server {
namespace {

Peer ipv4_peer(const in_addr& address, uint16_t port) {
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  Peer peer;
  peer.address = text.data();
  peer.name = absl::StrCat("ipv4:", peer.address, ":", port);
  peer.label = peer.name;
  peer.limit_key = peer.address;
  return peer;
}

Peer ipv6_peer(const sockaddr_in6& socket_address) {
  const uint16_t port = ntohs(socket_address.sin6_port);
  if (IN6_IS_ADDR_V4MAPPED(&socket_address.sin6_addr)) {
    in_addr v4{};
    std::memcpy(&v4, socket_address.sin6_addr.s6_addr + 12, sizeof v4);
    return ipv4_peer(v4, port);
  }
  std::array<char, INET6_ADDRSTRLEN> text{};
  inet_ntop(AF_INET6, &socket_address.sin6_addr, text.data(), text.size());
  Peer peer;
  peer.address = text.data();
  // gRPC writes the name as a URI, in which brackets and the sign % are escaped.
  const uint32_t scope = socket_address.sin6_scope_id;
  peer.name = absl::StrCat("ipv6:%5B", peer.address, scope != 0 ? absl::StrCat("%25", scope) : "", "%5D:", port);
  peer.label = peer.name;
  in6_addr network = socket_address.sin6_addr;
  std::memset(network.s6_addr + 8, 0, 8);
  inet_ntop(AF_INET6, &network, text.data(), text.size());
  peer.limit_key = absl::StrCat(text.data(), "/64");
  return peer;
}

// Reads and discards the bytes that have arrived at a socket. After shutdown() the kernel may still hold megabytes of
// these bytes, and the transport would handle the frames in them. Because the bytes are discarded, the transport sees a
// gap in the stream, which is an error, and then the end of the stream.
void discard_arrived(int descriptor) {
  std::array<char, 16 << 10> bytes;
  while (recv(descriptor, bytes.data(), bytes.size(), MSG_DONTWAIT) > 0) {
  }
}

std::optional<Peer> unix_peer(int descriptor) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return std::nullopt;
  Peer peer;
  peer.name = absl::StrCat("fd:", descriptor);
  peer.label = absl::StrCat("unix:uid=", credentials.uid);
  if (credentials.pid > 0) absl::StrAppend(&peer.label, ",pid=", credentials.pid);
  peer.address = "unix";
  peer.limit_key = absl::StrCat("uid:", credentials.uid);
  peer.uid = credentials.uid;
  return peer;
}

}  // namespace

std::optional<Peer> peer_of(int descriptor) {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  if (getpeername(descriptor, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return std::nullopt;
  if (storage.ss_family == AF_UNIX) return unix_peer(descriptor);
  if (storage.ss_family == AF_INET) {
    const auto& address = reinterpret_cast<const sockaddr_in&>(storage);
    return ipv4_peer(address.sin_addr, ntohs(address.sin_port));
  }
  if (storage.ss_family == AF_INET6) return ipv6_peer(reinterpret_cast<const sockaddr_in6&>(storage));
  return std::nullopt;
}

Connection::Connection(Peer peer, std::chrono::steady_clock::time_point accepted, int descriptor)
    : peer_(std::move(peer)), accepted_(accepted), descriptor_(descriptor) {}

Connection::~Connection() { release(); }

void Connection::call_cancelled() {
  const uint64_t cancelled = calls_cancelled_.fetch_add(1, std::memory_order_relaxed) + 1;
  const uint64_t cancelled_now = cancelled - window_cancelled_.load(std::memory_order_relaxed);
  if (cancelled_now <= kMaxCancelled) return;
  const uint64_t ended = calls_begun_.load(std::memory_order_relaxed) - calls_open_.load(std::memory_order_relaxed);
  const uint64_t ended_now = ended - window_ended_.load(std::memory_order_relaxed);
  if (cancelled_now * 2 > ended_now) close("more calls cancelled than finished");
}

void Connection::begin_cancel_window() {
  window_cancelled_.store(calls_cancelled_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  window_ended_.store(calls_begun_.load(std::memory_order_relaxed) - calls_open_.load(std::memory_order_relaxed),
                      std::memory_order_relaxed);
}

CallCounts Connection::counts() const {
  CallCounts counts;
  counts.calls_begun = calls_begun_.load(std::memory_order_relaxed);
  counts.calls_open = calls_open_.load(std::memory_order_relaxed);
  counts.calls_cancelled = calls_cancelled_.load(std::memory_order_relaxed);
  counts.metadata_bytes = metadata_bytes_.load(std::memory_order_relaxed);
  counts.messages_read = messages_read_.load(std::memory_order_relaxed);
  counts.message_bytes = message_bytes_.load(std::memory_order_relaxed);
  counts.bytes_written = bytes_written_.load(std::memory_order_relaxed);
  return counts;
}

std::shared_ptr<const void> Connection::identity() const {
  const MutexLock lock(mutex_);
  return identity_;
}

void Connection::set_identity(std::shared_ptr<const void> identity) {
  const MutexLock lock(mutex_);
  identity_.swap(identity);
}

bool Connection::close(const char* reason, Misuse misuse) {
  const MutexLock lock(mutex_);
  const char* open = nullptr;
  if (descriptor_ < 0 || !close_reason_.compare_exchange_strong(open, reason)) return false;
  was_misused_ = misuse == Misuse::kYes;
  shutdown(descriptor_, SHUT_RDWR);
  discard_arrived(descriptor_);
  return true;
}

uint64_t Connection::unexplained_since_last_look() {
  const uint64_t bytes = received().bytes, explained = message_bytes_.load(std::memory_order_relaxed);
  const uint64_t now = bytes > explained ? bytes - explained : 0;
  const uint64_t before = looked_at_unexplained_.exchange(now);
  return now > before ? now - before : 0;
}

ReceivedCounts Connection::received() const {
  const MutexLock lock(mutex_);
  tcp_info info{};
  socklen_t size = sizeof info;
  // An older kernel fills in only the first fields; the fields that it does not know stay 0.
  if (descriptor_ < 0 || getsockopt(descriptor_, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return {};
  return {info.tcpi_bytes_received, info.tcpi_data_segs_in};
}

int Connection::descriptor() const {
  const MutexLock lock(mutex_);
  return descriptor_;
}

void Connection::release() {
  const MutexLock lock(mutex_);
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

Peer peer_in_process() {
  Peer peer;
  peer.name = kInProcess;
  peer.label = peer.name;
  peer.address = peer.name;
  peer.limit_key = peer.name;
  peer.uid = geteuid();
  return peer;
}

}  // namespace locus::server
