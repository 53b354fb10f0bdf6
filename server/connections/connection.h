// One accepted connection as the rest of the server sees it: its peer, counts of its calls, and a function that closes
// it. The acceptor makes a Connection for each socket; a call finds its Connection in the ConnectionTable.
//
// Threads: every member may be called from any thread. Counting takes no lock. Invariant: calls_open is the number of
// begun calls that have not ended.
#ifndef LOCUS_SERVER_CONNECTIONS_CONNECTION_H_
#define LOCUS_SERVER_CONNECTIONS_CONNECTION_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/base/check.h"
#include "core/base/mutex.h"

namespace locus::server {

// The other end of a connection.
struct Peer {
  std::string name;             // name that gRPC gives the connection, such as ipv4:10.0.0.7:41234
  std::string label;            // for people: `name` or, for a unix socket, unix:uid=1000,pid=4711 (pid only if known)
  std::string address;          // address without port, such as 10.0.0.7; "unix" for a unix socket
  std::string limit_key;        // connections with equal keys share the limits of one address; see peer_of()
  std::optional<uint32_t> uid;  // user id of the process at the other end; no value for TCP
};

// Counts of the calls of a connection, and of the messages of these calls, since the connection was accepted.
// Exception: `calls_open` is the number of calls that are open now.
struct CallCounts {
  uint64_t calls_begun = 0;
  uint64_t calls_open = 0;
  uint64_t calls_cancelled = 0;  // calls that the peer ended before their answer
  uint64_t metadata_bytes = 0;   // metadata of the calls that began: names and values after decoding
  uint64_t messages_read = 0;
  uint64_t message_bytes = 0;  // bytes of the messages read, without frames and metadata
  uint64_t bytes_written = 0;
};

// Bytes and segments that the kernel has received on a TCP connection.
struct ReceivedCounts {
  uint64_t bytes = 0;
  uint64_t segments = 0;  // segments that carried data
};

// Argument of Connection::close(): whether the client misused the connection. After a misuse the client's address may
// open fewer new connections for a while.
enum class Misuse : uint8_t { kNo, kYes };

class Connection {
 public:
  static constexpr uint64_t kMaxCancelled = 1000;

  // Takes ownership of `descriptor`, a duplicate of the socket's descriptor. -1 means that there is no duplicate; then
  // close() has no effect.
  Connection(Peer peer, std::chrono::steady_clock::time_point accepted, int descriptor);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  const Peer& peer() const { return peer_; }
  std::chrono::steady_clock::time_point accepted() const { return accepted_; }

  // Functions that count the calls of this connection.
  void call_begun(uint64_t metadata_bytes) {
    calls_begun_.fetch_add(1, std::memory_order_relaxed);
    metadata_bytes_.fetch_add(metadata_bytes, std::memory_order_relaxed);
    calls_open_.fetch_add(1, std::memory_order_relaxed);
  }
  void call_ended() {
    const uint64_t open = calls_open_.fetch_sub(1, std::memory_order_relaxed);
    LOCUS_DCHECK_GT(open, 0u);
  }
  // Counts a call that the peer ended before its answer. Closes the connection immediately if, since
  // begin_cancel_window(), the peer has cancelled more than kMaxCancelled calls, and more calls than it let finish. The
  // periodic checks of the guard would detect this too late, because gRPC accepts calls very fast.
  void call_cancelled();
  // Restarts the count of cancelled calls. While bytes arrive, the guard calls this function about once a second.
  void begin_cancel_window();
  void message_read(uint64_t bytes) {
    messages_read_.fetch_add(1, std::memory_order_relaxed);
    message_bytes_.fetch_add(bytes, std::memory_order_relaxed);
  }
  void written(uint64_t bytes) { bytes_written_.fetch_add(bytes, std::memory_order_relaxed); }
  CallCounts counts() const;

  // Counts one refusal of credentials, and returns the number of such refusals so far.
  uint32_t wrong_credentials() { return wrong_credentials_.fetch_add(1, std::memory_order_relaxed) + 1; }

  // Time in seconds since 1970 from which the peer's certificate is no longer valid; 0 until the first call has set it.
  std::atomic<int64_t> certificate_end{0};

  // Bytes of memory that the connection's calls have claimed for moves, requests and replies. Calls add and subtract
  // their claims, and keep the sum at or below MemoryBudget::connection_share().
  std::atomic<uint64_t> claimed_bytes{0};

  // Number of this connection in gRPC's statistics (channelz); 0 until StreamCounter has found the number.
  std::atomic<int64_t> transport_id{0};

  // Returns the identity that set_identity() stored last; null if there is none. The identity is kept so that later
  // calls need not check the same credentials again.
  std::shared_ptr<const void> identity() const LOCUS_EXCLUDES(mutex_);
  void set_identity(std::shared_ptr<const void> identity) LOCUS_EXCLUDES(mutex_);

  // Shuts the connection down in both directions and discards the bytes that the transport has not read yet. The
  // connection's calls end as if the peer had gone. `reason` must be a constant. Returns false if the connection is
  // already closed or has no descriptor.
  bool close(const char* reason, Misuse misuse = Misuse::kYes) LOCUS_EXCLUDES(mutex_);
  // Returns the reason given to the first close(); null if the connection was not closed from this side.
  const char* close_reason() const { return close_reason_.load(); }
  // Returns whether the connection was closed because its client misused it.
  bool was_misused() const { return was_misused_.load(); }

  // Returns the counts of the kernel; zeros if the connection is not TCP or its descriptor is released.
  ReceivedCounts received() const LOCUS_EXCLUDES(mutex_);

  // Returns the number of bytes that the kernel has received since the previous use of this function, minus the bytes
  // of the messages that were read since then; 0 for connections that are not TCP.
  uint64_t unexplained_since_last_look();

  // Returns the descriptor; -1 after release(). Only for the thread that calls release().
  int descriptor() const LOCUS_EXCLUDES(mutex_);
  // Closes the descriptor. Called when the connection has ended, or when the server ends.
  void release() LOCUS_EXCLUDES(mutex_);

 private:
  const Peer peer_;
  const std::chrono::steady_clock::time_point accepted_;
  std::atomic<uint64_t> calls_begun_{0};
  std::atomic<uint64_t> metadata_bytes_{0};
  std::atomic<uint64_t> calls_open_{0};
  std::atomic<uint64_t> calls_cancelled_{0};
  std::atomic<uint64_t> window_cancelled_{0};  // value of calls_cancelled when the window began
  std::atomic<uint64_t> window_ended_{0};      // number of ended calls when the window began
  std::atomic<uint64_t> messages_read_{0};
  std::atomic<uint64_t> message_bytes_{0};
  std::atomic<uint64_t> bytes_written_{0};
  std::atomic<uint32_t> wrong_credentials_{0};
  std::atomic<uint64_t> looked_at_unexplained_{0};
  std::atomic<const char*> close_reason_{nullptr};
  std::atomic<bool> was_misused_{false};
  mutable Mutex mutex_;
  int descriptor_ LOCUS_GUARDED_BY(mutex_);
  std::shared_ptr<const void> identity_ LOCUS_GUARDED_BY(mutex_);
};

// Returns the peer of the connected socket `descriptor`, with the name that gRPC gives the connection. gRPC names a
// unix connection after its descriptor, such as fd:7; in the peer of such a connection, `uid` is the user id of the
// other process. The limit key is the IPv4 address, the first 64 bits of the IPv6 address (a subscriber owns all
// addresses that begin with these bits), or the user id. Returns nullopt if the peer has already gone.
std::optional<Peer> peer_of(int descriptor);

// Name of the peer of all callers in this process.
inline constexpr const char* kInProcess = "in-process";
// Returns the peer of all callers in this process, which call through gRPC's in-process channels. gRPC does not tell
// the channels of a server apart, so these callers share the limits of one connection. `uid` is the user id of this
// process: with access control, the callers have the identity of this user, as over a unix socket.
Peer peer_in_process();

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_CONNECTION_H_
