#include "server/connections/flood_guard.h"

#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/check.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kLookInterval{10};
// Interval between two checks of the connections while the guard is alert. The guard is alert for kAlertTime after a
// connection was closed or had many unexplained bytes. The interval is short because a client that floods sends a
// megabyte or begins 100 streams in a millisecond, and connects again immediately.
constexpr milliseconds kAlertInterval{2};
constexpr std::chrono::seconds kAlertTime{1};
constexpr double kAlertBytes = 1 << 20;
constexpr std::chrono::seconds kCancelWindow{1};
constexpr int kEventsAtOnce = 256;

// Bytes that a call needs in addition to the metadata that gRPC reports: its frame, method, address and other fields.
constexpr uint64_t kCallBytes = 1024;
// Bytes that frames and TLS add to messages: a fixed number for each message, and a share of all message bytes.
constexpr uint64_t kBytesBesideMessage = 96;
constexpr uint64_t kFrameShare = 32;  // 1/32: frames of 16 KiB need 0.06 %, records of TLS up to 2 %
// While a peer reads a reply, it sends at most one byte of window updates for each kWrittenPerByte bytes of the reply.
constexpr uint64_t kWrittenPerByte = 64;
constexpr uint64_t kSegmentBytes = 64;
// After this number of received bytes outside of messages, the streams of a connection are counted. A count takes about
// 15 us. With this number of bytes, a client that resets its calls can begin up to 600 streams.
constexpr uint64_t kCountedBytes = 16 << 10;

double explained_bytes(const CallCounts& now, const CallCounts& before) {
  const uint64_t messages = now.message_bytes - before.message_bytes;
  const uint64_t frames = messages / kFrameShare,
                 written = (now.bytes_written - before.bytes_written) / kWrittenPerByte;
  return static_cast<double>(messages + frames + (now.messages_read - before.messages_read) * kBytesBesideMessage +
                             (now.calls_begun - before.calls_begun) * kCallBytes +
                             (now.metadata_bytes - before.metadata_bytes) + written);
}

double received_bytes(const ReceivedCounts& now, const ReceivedCounts& before) {
  // The kernel's counter of segments has 32 bits.
  const uint64_t segments = static_cast<uint32_t>(now.segments - before.segments);
  return static_cast<double>(std::max(now.bytes - before.bytes, segments * kSegmentBytes));
}

// Returns whether, within one second, the peer has cancelled more calls than it let finish, and more calls than
// limits.cancelled_per_second.
bool cancels_too_many(const FloodSample& sample, const FloodLimits& limits, FloodBudget& budget) {
  const CallCounts& begin = budget.second_begin.counts;
  const uint64_t cancelled = sample.counts.calls_cancelled - begin.calls_cancelled;
  const uint64_t ended = sample.counts.calls_begun - begin.calls_begun + begin.calls_open - sample.counts.calls_open;
  const uint64_t finished = ended > cancelled ? ended - cancelled : 0;
  const bool too_many = cancelled > limits.cancelled_per_second && cancelled > finished;
  if (sample.time - budget.second_begin.time >= kCancelWindow) budget.second_begin = sample;
  return too_many;
}

}  // namespace

FloodVerdict assess(const FloodSample& sample, const FloodLimits& limits, FloodBudget& budget) {
  if (sample.streams > limits.streams) return FloodVerdict::kTooManyStreams;
  const double seconds = std::chrono::duration<double>(sample.time - budget.last.time).count();
  const double received = received_bytes(sample.received, budget.last.received);
  const double accepted = explained_bytes(sample.counts, budget.last.counts) +
                          std::max(0.0, seconds) * static_cast<double>(limits.bytes_per_second);
  budget.unexplained = std::max(0.0, budget.unexplained + received - accepted);
  budget.last = sample;
  // gRPC reports a unary call only when its message has arrived, so more messages may be arriving than calls are open.
  // Allow as many messages as there are streams in memory or open calls, whichever number is larger, and one more for a
  // stream that gRPC has not read yet.
  budget.streams = sample.streams.value_or(budget.streams);
  const uint64_t messages = std::max(budget.streams, sample.counts.calls_open) + 1;
  const uint64_t arriving = std::min(limits.buffered_bytes, messages * limits.message_bytes);
  if (budget.unexplained > static_cast<double>(limits.burst_bytes + arriving)) return FloodVerdict::kTooManyBytes;
  return cancels_too_many(sample, limits, budget) ? FloodVerdict::kTooManyCancelled : FloodVerdict::kHonest;
}

FloodGuard::FloodGuard(const FloodLimits& limits, CountStreams count_streams, OnClosed on_closed)
    : limits_(limits),
      count_streams_(std::move(count_streams)),
      on_closed_(std::move(on_closed)),
      epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  LOCUS_CHECK_LE(0, epoll_);
  thread_ = std::thread([this] { run(); });
}

FloodGuard::~FloodGuard() {
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    end_.notify_all();
  }
  thread_.join();
  close(epoll_);
}

void FloodGuard::watch(const std::shared_ptr<Connection>& connection) {
  auto watched = std::make_shared<Watched>();
  watched->connection = connection;
  watched->budget.last.time = connection->accepted();
  watched->budget.second_begin = watched->budget.last;
  {
    const MutexLock lock(mutex_);
    watched_[connection.get()] = std::move(watched);
  }
  // With EPOLLET, a check finds a connection only if bytes have arrived since the previous check.
  epoll_event event{};
  event.events = EPOLLIN | EPOLLET;
  event.data.ptr = connection.get();
  epoll_ctl(epoll_, EPOLL_CTL_ADD, connection->descriptor(), &event);
}

void FloodGuard::forget(const Connection& connection) {
  if (const int descriptor = connection.descriptor(); descriptor >= 0)
    epoll_ctl(epoll_, EPOLL_CTL_DEL, descriptor, nullptr);
  std::shared_ptr<Watched> forgotten;  // destroyed without the lock
  const MutexLock lock(mutex_);
  const auto found = watched_.find(&connection);
  if (found == watched_.end()) return;
  forgotten = std::move(found->second);
  watched_.erase(found);
}

void FloodGuard::run() {
  while (wait()) look();
}

bool FloodGuard::wait() {
  const steady_clock::time_point now = steady_clock::now();
  const steady_clock::time_point next = now + (now < alert_until_ ? kAlertInterval : kLookInterval);
  const MutexLock lock(mutex_);
  while (!ended_ && end_.wait_until(mutex_, next)) {
  }
  return !ended_;
}

void FloodGuard::look() {
  std::array<epoll_event, kEventsAtOnce> events;
  int count = kEventsAtOnce;
  while (count == kEventsAtOnce) {
    count = epoll_wait(epoll_, events.data(), kEventsAtOnce, 0);
    for (int i = 0; i < count; ++i) {
      std::shared_ptr<Watched> watched;
      {
        const MutexLock lock(mutex_);
        const auto found = watched_.find(static_cast<const Connection*>(events[i].data.ptr));
        if (found != watched_.end()) watched = found->second;
      }
      if (watched != nullptr) look_at(watched);
    }
  }
}

bool FloodGuard::must_count(const FloodSample& sample, Watched& watched) {
  const FloodSample& last = watched.budget.last;
  if (sample.received.bytes == 0) return true;  // a unix socket, whose bytes the kernel does not count
  const uint64_t received = sample.received.bytes - last.received.bytes;
  const uint64_t messages = sample.counts.message_bytes - last.counts.message_bytes;
  watched.uncounted_bytes += received > messages ? received - messages : 0;
  if (watched.uncounted_bytes < kCountedBytes) return false;
  watched.uncounted_bytes = 0;
  return true;
}

void FloodGuard::look_at(const std::shared_ptr<Watched>& watched) {
  Connection& connection = *watched->connection;
  // Read the counts of calls and messages first, then the kernel's count of received bytes. If a message arrives
  // between the two reads, its bytes look unexplained now, but the next check counts the message. In the other order,
  // the message would be counted now and its bytes at the next check, when no new message explains them.
  FloodSample sample;
  sample.time = steady_clock::now();
  sample.counts = connection.counts();
  sample.received = connection.received();
  // A count that has decreased means that the connection was released: then received() returns 0.
  if (sample.received.bytes < watched->budget.last.received.bytes) return;
  if (sample.time - watched->window_begin >= kCancelWindow) {
    watched->window_begin = sample.time;
    connection.begin_cancel_window();
  }
  if (must_count(sample, *watched)) sample.streams = count_streams_(connection);
  const FloodVerdict verdict = assess(sample, limits_, watched->budget);
  if (watched->budget.unexplained > kAlertBytes) alert_until_ = sample.time + kAlertTime;
  const char* reason = nullptr;
  switch (verdict) {
    case FloodVerdict::kHonest:
      return;
    case FloodVerdict::kTooManyBytes:
      reason = "more protocol bytes than its calls explain";
      break;
    case FloodVerdict::kTooManyCancelled:
      reason = "more calls cancelled than finished";
      break;
    case FloodVerdict::kTooManyStreams:
      reason = "more streams than it may open, cancelled before they were accepted";
      break;
  }
  alert_until_ = sample.time + kAlertTime;
  close_for(connection, reason);
}

void FloodGuard::close_for(Connection& connection, const char* reason) {
  if (!connection.close(reason)) return;
  closed_.fetch_add(1);
  on_closed_(connection, reason);
}

}  // namespace locus::server
