// Accepts the connections of all listening sockets. A new connection is handed over to gRPC only if it is within the
// limits and sends, in time, the first bytes of a gRPC client. The acceptor keeps a duplicate of the connection's
// descriptor, so that it can close the connection itself, and releases the duplicate when the connection has ended.
//
// Threads: one thread does all work and calls the hooks; the members may be called from any thread. Invariant: each
// admitted connection is counted by the limiter until it has ended, and is in exactly one of two states: opening (the
// acceptor owns its only descriptor) or handed over (the table has an entry for it).
#ifndef LOCUS_SERVER_CONNECTIONS_ACCEPTOR_H_
#define LOCUS_SERVER_CONNECTIONS_ACCEPTOR_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "server/connections/connection.h"
#include "server/connections/connection_limiter.h"
#include "server/connections/connection_table.h"
#include "server/connections/first_bytes.h"
#include "server/connections/flood_guard.h"
#include "server/connections/listening_socket.h"

namespace locus::server {

struct AcceptorOptions {
  ConnectionLimits limits;
  Transport tcp_transport = Transport::kPlain;   // unix sockets are always plain
  std::chrono::milliseconds opening_timeout{0};  // maximum time for the first bytes of a client; 0 = no limit
  std::chrono::milliseconds idle_timeout{0};     // maximum time without an open call; 0 = no limit
};

// Functions that the acceptor calls on its thread.
struct AcceptorHooks {
  // Takes over the non-blocking descriptor of a connection. The table already contains the connection.
  std::function<void(int descriptor, const std::shared_ptr<Connection>& connection)> hand_over;
  // Reports refused connections, at most once a second: `refused` is their number since the last report, `address` and
  // `reason` describe the last of them.
  std::function<void(uint64_t refused, const std::string& address, const char* reason)> refused;
};

class Acceptor {
 public:
  // Starts the thread. `sockets` already listen, so clients that connect before this call wait in the kernel. `table`
  // and `guard` must outlive the acceptor.
  Acceptor(std::vector<ListeningSocket> sockets, const AcceptorOptions& options, ConnectionTable& table,
           FloodGuard& guard, AcceptorHooks hooks);
  // Ends the thread and releases all connections, whether they are opening or handed over.
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  // Closes the listening sockets and the connections that are still opening; connections that were handed over stay.
  // When stop_accepting() returns, no further connection is handed over.
  void stop_accepting() LOCUS_EXCLUDES(mutex_);

 private:
  using Time = std::chrono::steady_clock::time_point;

  // A connection from accept() until its end.
  struct Entry {
    Peer peer;
    Transport transport = Transport::kPlain;
    int descriptor = -1;                     // descriptor of an opening connection
    std::shared_ptr<Connection> connection;  // connection that was handed over
    Time since;                              // time of accept() or, once handed over, last time of activity
    uint64_t calls_begun = 0;                // calls begun until the last check for idle connections
  };
  using Entries = absl::flat_hash_map<uint64_t, Entry>;

  void run() LOCUS_EXCLUDES(mutex_);
  // Returns the milliseconds until the next timed work, as an argument of epoll_wait(); -1 if there is none.
  int wait_time() const;
  void handle(uint64_t id, uint32_t events, Time now);
  void accept_some(ListeningSocket& listening, Time now);
  void admit(int descriptor, const ListeningSocket& listening, Time now);
  void opening(uint64_t id);
  void hand_over(uint64_t id, Entry& entry);
  void ended(uint64_t id);
  void close_overdue(Time now);
  void refuse(int descriptor, const std::string& address, const char* reason);
  void report(Time now);
  void pause(Time now);
  void resume();
  void close_sockets() LOCUS_EXCLUDES(mutex_);
  void wake() const;
  void add_event(int descriptor, uint32_t events, uint64_t id) const;

  std::vector<ListeningSocket> sockets_;
  const AcceptorOptions options_;
  ConnectionTable& table_;  // the acceptor also updates the table's counters
  FloodGuard& guard_;
  const AcceptorHooks hooks_;
  const int epoll_;
  const int wake_;

  // Used by the thread only.
  ConnectionLimiter limiter_;
  Entries entries_;
  uint64_t next_id_;
  size_t opening_ = 0;
  bool closed_ = false;  // whether the listening sockets are closed
  bool paused_ = false;
  Time resume_at_;
  Time next_check_;
  uint64_t unreported_ = 0;
  Time last_report_;
  std::string last_address_;
  const char* last_reason_ = nullptr;

  std::atomic<bool> stop_{false};
  std::atomic<bool> end_{false};
  Mutex mutex_;
  ConditionVariable stopped_changed_;
  bool stopped_ LOCUS_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_ACCEPTOR_H_
