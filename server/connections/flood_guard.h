// Closes connections that send more bytes than their calls explain: floods of small frames, endless headers, and calls
// that are begun only to be cancelled. gRPC does not report such bytes to the application, so the guard compares the
// bytes that the kernel has received with the bytes that the calls of the connection have read. gRPC begins calls
// faster than the application can accept and end them, so, in addition, the guard asks gRPC how many streams of a
// connection are still in gRPC's memory. Code that serves a call only updates the counts of the call's connection.
//
// Threads: watch() and forget() may be called from any thread. The guard's thread periodically checks the connections
// that have received bytes since its previous check; idle connections cost nothing.
#ifndef LOCUS_SERVER_CONNECTIONS_FLOOD_GUARD_H_
#define LOCUS_SERVER_CONNECTIONS_FLOOD_GUARD_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "absl/container/flat_hash_map.h"
#include "core/base/mutex.h"
#include "server/connections/connection.h"

namespace locus::server {

// Limits on the traffic of one connection. See assess().
struct FloodLimits {
  uint64_t bytes_per_second = uint64_t{1} << 20;  // unexplained bytes a second that are always accepted
  uint64_t burst_bytes = uint64_t{4} << 20;       // unexplained bytes that are accepted in a burst
  // Limits on the bytes of messages that have arrived but that no call has read yet. The limit for each open call or
  // stream is `message_bytes`, the maximum size of a message. The limit for all of them together is `buffered_bytes`,
  // the size of gRPC's buffers.
  uint64_t message_bytes = uint64_t{32} << 20;
  uint64_t buffered_bytes = uint64_t{256} << 20;
  uint64_t cancelled_per_second = 1000;  // cancelled calls a second that are always accepted
  // Maximum number of streams that the transport may keep in memory for a connection. It is larger than the number of
  // streams that a client may have open at a time.
  uint64_t streams = 4096;
};

// State of a connection at one time.
struct FloodSample {
  std::chrono::steady_clock::time_point time;
  ReceivedCounts received;
  CallCounts counts;
  std::optional<uint64_t> streams;  // streams that the transport keeps in memory, if they were counted
};

// State that is kept for a connection between two samples.
struct FloodBudget {
  FloodSample last;
  double unexplained = 0;    // unexplained bytes, less those that are always accepted
  uint64_t streams = 0;      // streams in memory when they were counted last
  FloodSample second_begin;  // first sample of the current second, in which cancelled calls are counted
};

enum class FloodVerdict : uint8_t { kHonest, kTooManyBytes, kTooManyCancelled, kTooManyStreams };

// Assesses a connection by its sample, and updates `budget`. Before the first call, `last` and `second_begin` of the
// budget must be the sample at the time when the connection was accepted. Received bytes are explained by the metadata
// of calls, by messages with their frames, and by written bytes, for which the peer sends window updates. A segment
// counts as at least 64 bytes, because handling a smaller segment costs as much work.
FloodVerdict assess(const FloodSample& sample, const FloodLimits& limits, FloodBudget& budget);

class FloodGuard {
 public:
  using OnClosed = std::function<void(const Connection& connection, const char* reason)>;
  // Function that returns how many streams of a connection the transport keeps in memory. These are the streams that
  // the peer has begun and that are not yet destroyed, whether or not their calls were accepted. Returns nullopt if the
  // number is unknown.
  using CountStreams = std::function<std::optional<uint64_t>(Connection& connection)>;

  // Starts the thread, which calls `count_streams` for unix connections that send bytes, and for other connections that
  // send many bytes outside of messages. `on_closed` is called after the guard has closed a connection, on the thread
  // that has closed it.
  FloodGuard(const FloodLimits& limits, CountStreams count_streams, OnClosed on_closed);
  ~FloodGuard();
  FloodGuard(const FloodGuard&) = delete;
  FloodGuard& operator=(const FloodGuard&) = delete;

  // Begins to check a connection that was just accepted.
  void watch(const std::shared_ptr<Connection>& connection) LOCUS_EXCLUDES(mutex_);
  // Stops checking the connection. Call forget() before Connection::release().
  void forget(const Connection& connection) LOCUS_EXCLUDES(mutex_);

  // Closes a connection that another check has found to flood the server. Does nothing if it is already closed.
  void close_for(Connection& connection, const char* reason);

  // Returns the number of connections that were closed.
  uint64_t closed() const { return closed_.load(); }

 private:
  struct Watched {
    std::shared_ptr<Connection> connection;
    FloodBudget budget;
    uint64_t uncounted_bytes = 0;                        // received outside of messages since the last count of streams
    std::chrono::steady_clock::time_point window_begin;  // time of the last call of Connection::begin_cancel_window()
  };

  void run() LOCUS_EXCLUDES(mutex_);
  // Waits until the next check is due. Returns false if the guard ends.
  bool wait() LOCUS_EXCLUDES(mutex_);
  void look() LOCUS_EXCLUDES(mutex_);
  void look_at(const std::shared_ptr<Watched>& watched);
  // Returns whether the streams of the connection must be counted: many of the bytes that have arrived belong to no
  // message, or the connection is a unix socket.
  static bool must_count(const FloodSample& sample, Watched& watched);

  const FloodLimits limits_;
  const CountStreams count_streams_;
  const OnClosed on_closed_;
  const int epoll_;
  std::atomic<uint64_t> closed_{0};
  // Time until which the guard's thread checks more often; used by this thread only.
  std::chrono::steady_clock::time_point alert_until_;
  Mutex mutex_;
  ConditionVariable end_;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  absl::flat_hash_map<const Connection*, std::shared_ptr<Watched>> watched_ LOCUS_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_FLOOD_GUARD_H_
