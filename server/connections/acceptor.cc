#include "server/connections/acceptor.h"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "core/base/check.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Maximum number of connections that are accepted from one socket before the other sockets are served.
constexpr int kAcceptsAtOnce = 64;
constexpr int kWakeUpsAtOnce = 256;
// Reason given to Connection::close() for idle connections.
constexpr const char* kIdle = "idle for too long";
constexpr milliseconds kPause{100};  // pause after accept() has failed because descriptors or memory are used up
constexpr milliseconds kCheckInterval{1000};
constexpr milliseconds kReportInterval{1000};

// Ids of epoll events: below kWakeId, the index of a listening socket; kWakeId, the wake-up; above it, a connection.
constexpr uint64_t kWakeId = 1u << 16;
constexpr uint64_t kFirstConnectionId = kWakeId + 1;

// Closes a connection with a reset, so that neither side keeps any state of it.
void reset_connection(int descriptor) {
  const linger at_once{1, 0};
  setsockopt(descriptor, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  close(descriptor);
}

const char* wrong_beginning(Transport transport) {
  return transport == Transport::kTls ? "the client did not begin with TLS" : "the client did not begin with HTTP/2";
}

bool lacks_resources(int error) { return error == EMFILE || error == ENFILE || error == ENOMEM || error == ENOBUFS; }

}  // namespace

Acceptor::Acceptor(std::vector<ListeningSocket> sockets, const AcceptorOptions& options, ConnectionTable& table,
                   FloodGuard& guard, AcceptorHooks hooks)
    : sockets_(std::move(sockets)),
      options_(options),
      table_(table),
      guard_(guard),
      hooks_(std::move(hooks)),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      limiter_(options.limits),
      next_id_(kFirstConnectionId) {
  LOCUS_CHECK_LE(0, epoll_);
  LOCUS_CHECK_LE(0, wake_);
  LOCUS_CHECK_LT(sockets_.size(), kWakeId);
  add_event(wake_, EPOLLIN, kWakeId);
  resume();
  next_check_ = steady_clock::now() + kCheckInterval;
  thread_ = std::thread([this] { run(); });
}

Acceptor::~Acceptor() {
  end_.store(true);
  wake();
  thread_.join();
  for (auto& [id, entry] : entries_) {
    if (entry.connection == nullptr) continue;
    guard_.forget(*entry.connection);
    table_.remove(*entry.connection);
    entry.connection->release();
  }
  close(wake_);
  close(epoll_);
}

void Acceptor::stop_accepting() {
  stop_.store(true);
  wake();
  const MutexLock lock(mutex_);
  while (!stopped_) stopped_changed_.wait(mutex_);
}

void Acceptor::run() {
  std::array<epoll_event, kWakeUpsAtOnce> events;
  while (!end_.load()) {
    const int count = epoll_wait(epoll_, events.data(), kWakeUpsAtOnce, wait_time());
    const Time now = steady_clock::now();
    for (size_t i = 0; static_cast<int>(i) < count; ++i) handle(events[i].data.u64, events[i].events, now);
    if (stop_.load() && !closed_) close_sockets();
    if (paused_ && now >= resume_at_) resume();
    if (now >= next_check_) {
      next_check_ = now + kCheckInterval;
      close_overdue(now);
    }
    report(now);
  }
  close_sockets();
}

int Acceptor::wait_time() const {
  const Time now = steady_clock::now();
  Time due = Time::max();
  if (paused_) due = std::min(due, resume_at_);
  if (opening_ > 0 || (options_.idle_timeout.count() > 0 && !entries_.empty())) due = std::min(due, next_check_);
  if (unreported_ > 0) due = std::min(due, last_report_ + kReportInterval);
  if (due == Time::max()) return -1;
  if (due <= now) return 0;
  return static_cast<int>(std::chrono::ceil<milliseconds>(due - now).count());
}

void Acceptor::handle(uint64_t id, uint32_t events, Time now) {
  if (id < sockets_.size()) return accept_some(sockets_[id], now);
  if (id == kWakeId) {
    eventfd_t ignored = 0;
    eventfd_read(wake_, &ignored);
    return;
  }
  const auto found = entries_.find(id);
  if (found == entries_.end()) return;
  if (found->second.connection == nullptr) return opening(id);
  if ((events & EPOLLHUP) != 0) ended(id);
}

// Accepts a bounded number of connections; epoll reports the socket again if there are more.
void Acceptor::accept_some(ListeningSocket& listening, Time now) {
  for (int i = 0; i < kAcceptsAtOnce && !paused_; ++i) {
    const int descriptor = accept4(listening.descriptor(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (descriptor >= 0) {
      table_.counters().accepted.fetch_add(1);
      admit(descriptor, listening, now);
    } else if (lacks_resources(errno)) {
      pause(now);
    } else if (errno == EAGAIN) {
      return;
    }
  }
}

void Acceptor::admit(int descriptor, const ListeningSocket& listening, Time now) {
  std::optional<Peer> peer = peer_of(descriptor);
  if (!peer) {  // the peer has already gone
    close(descriptor);
    return;
  }
  switch (limiter_.admit(peer->limit_key, now)) {
    case Admission::kAdmitted:
      break;
    case Admission::kFull:
      table_.counters().refused_full.fetch_add(1);
      return refuse(descriptor, peer->address, "max-connections");
    case Admission::kAddressFull:
      table_.counters().refused_address.fetch_add(1);
      return refuse(descriptor, peer->address, "max-connections-per-address");
    case Admission::kTooFast:
      table_.counters().refused_too_fast.fetch_add(1);
      return refuse(descriptor, peer->address, "max-new-connections");
  }
  const uint64_t id = next_id_++;
  Entry& entry = entries_[id];
  entry.peer = *std::move(peer);
  entry.transport = listening.local() ? Transport::kPlain : options_.tcp_transport;
  entry.descriptor = descriptor;
  entry.since = now;
  ++opening_;
  // With EPOLLET, epoll reports a connection with too few bytes once for each arrival of bytes, not continuously.
  add_event(descriptor, EPOLLIN | EPOLLRDHUP | EPOLLET, id);
}

// Examines the first bytes of a connection without removing them from the socket.
void Acceptor::opening(uint64_t id) {
  Entry& entry = entries_.at(id);
  std::array<char, kFirstBytes> bytes;
  const ssize_t count = recv(entry.descriptor, bytes.data(), bytes.size(), MSG_PEEK | MSG_DONTWAIT);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
  Opening seen = Opening::kBad;  // stays kBad if the peer has gone
  if (count > 0) seen = examine_first_bytes(entry.transport, {bytes.data(), static_cast<size_t>(count)});
  if (seen == Opening::kIncomplete) return;
  --opening_;
  if (seen == Opening::kGood) return hand_over(id, entry);
  table_.counters().refused_bytes.fetch_add(1);
  const int descriptor = entry.descriptor;
  const std::string address = entry.peer.address;
  const Transport transport = entry.transport;
  limiter_.leave(entry.peer.limit_key);
  entries_.erase(id);
  if (count > 0) return refuse(descriptor, address, wrong_beginning(transport));
  reset_connection(descriptor);
}

void Acceptor::hand_over(uint64_t id, Entry& entry) {
  const int descriptor = std::exchange(entry.descriptor, -1);
  epoll_ctl(epoll_, EPOLL_CTL_DEL, descriptor, nullptr);
  const int duplicate = fcntl(descriptor, F_DUPFD_CLOEXEC, 0);
  if (duplicate < 0) {  // no descriptor is left
    limiter_.leave(entry.peer.limit_key);
    entries_.erase(id);
    return reset_connection(descriptor);
  }
  entry.connection = std::make_shared<Connection>(entry.peer, entry.since, duplicate);
  entry.since = steady_clock::now();
  table_.add(entry.connection);
  guard_.watch(entry.connection);
  // Without EPOLLIN, epoll reports only errors and the shutdown of both directions. gRPC shuts both directions down
  // before it closes its descriptor.
  add_event(duplicate, EPOLLET, id);
  hooks_.hand_over(descriptor, entry.connection);
}

// Releases a connection that has ended.
void Acceptor::ended(uint64_t id) {
  const auto found = entries_.find(id);
  const Entry entry = std::move(found->second);
  entries_.erase(found);
  limiter_.leave(entry.peer.limit_key);
  // Charge the address of a client that misused its connection. Otherwise a client that floods would connect again
  // immediately, and each connection may cost some megabytes before the guard closes it. Users of unix sockets are not
  // charged: a user may run a proxy, and after a charge the proxy's other clients would be refused too.
  if (entry.connection->was_misused() && !entry.peer.uid)
    limiter_.charge(entry.peer.limit_key, options_.limits.new_per_second);
  guard_.forget(*entry.connection);
  table_.remove(*entry.connection);
  epoll_ctl(epoll_, EPOLL_CTL_DEL, entry.connection->descriptor(), nullptr);
  entry.connection->release();
  table_.counters().ended.fetch_add(1);
}

// Closes connections whose clients have not sent their first bytes in time, and connections that have been idle for too
// long.
void Acceptor::close_overdue(Time now) {
  std::vector<uint64_t> late;
  for (auto& [id, entry] : entries_) {
    if (entry.connection == nullptr) {
      if (options_.opening_timeout.count() > 0 && now - entry.since >= options_.opening_timeout) late.push_back(id);
      continue;
    }
    if (options_.idle_timeout.count() == 0) continue;
    const CallCounts counts = entry.connection->counts();
    if (counts.calls_open > 0 || counts.calls_begun != std::exchange(entry.calls_begun, counts.calls_begun)) {
      entry.since = now;
    } else if (now - entry.since >= options_.idle_timeout && entry.connection->close(kIdle, Misuse::kNo)) {
      table_.counters().idle.fetch_add(1);
    }
  }
  for (const uint64_t id : late) {
    const Entry entry = std::move(entries_.at(id));
    entries_.erase(id);
    --opening_;
    table_.counters().late.fetch_add(1);
    limiter_.leave(entry.peer.limit_key);
    refuse(entry.descriptor, entry.peer.address, "handshake-timeout-s");
  }
}

void Acceptor::refuse(int descriptor, const std::string& address, const char* reason) {
  reset_connection(descriptor);
  ++unreported_;
  last_address_ = address;
  last_reason_ = reason;
}

void Acceptor::report(Time now) {
  if (unreported_ == 0 || now - last_report_ < kReportInterval) return;
  last_report_ = now;
  hooks_.refused(std::exchange(unreported_, 0), last_address_, last_reason_);
}

// Stops accepting connections for kPause. The sockets continue to listen, so new connections wait in the kernel.
void Acceptor::pause(Time now) {
  paused_ = true;
  resume_at_ = now + kPause;
  for (const ListeningSocket& listening : sockets_) epoll_ctl(epoll_, EPOLL_CTL_DEL, listening.descriptor(), nullptr);
}

void Acceptor::resume() {
  paused_ = false;
  for (size_t i = 0; i < sockets_.size(); ++i) add_event(sockets_[i].descriptor(), EPOLLIN, i);
}

void Acceptor::close_sockets() {
  sockets_.clear();
  closed_ = true;
  paused_ = false;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    if (entry->second.connection != nullptr) {
      ++entry;
      continue;
    }
    limiter_.leave(entry->second.peer.limit_key);
    reset_connection(entry->second.descriptor);
    entries_.erase(entry++);
  }
  opening_ = 0;
  const MutexLock lock(mutex_);
  stopped_ = true;
  stopped_changed_.notify_all();
}

void Acceptor::wake() const { eventfd_write(wake_, 1); }

void Acceptor::add_event(int descriptor, uint32_t events, uint64_t id) const {
  epoll_event event{};
  event.events = events;
  event.data.u64 = id;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, descriptor, &event);
}

}  // namespace locus::server
