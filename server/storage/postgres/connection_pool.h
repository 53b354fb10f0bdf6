// A bounded number of connections to the engine, shared by threads. Connections go to one host, the last that accepted
// writes. If a connection is lost, later ones try the next hosts first: an isolated old primary still accepts
// connections, and a client that returns to it would wait for ever.
//
// Threads: any thread. acquire() waits for a free connection, or for a host to accept one; no lock is held while
// connecting. Invariant: the number of connections, idle and in use, is at most the capacity.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_CONNECTION_POOL_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_CONNECTION_POOL_H_

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "server/storage/postgres/connection.h"

namespace locus::server {

class ConnectionPool {
 public:
  // Function that checks and prepares each new connection before its first use.
  using Prepare = std::function<absl::Status(Connection&, Deadline)>;

  ConnectionPool(EngineAddress address, size_t capacity, std::chrono::milliseconds connect_wait, Prepare prepare)
      : address_(std::move(address)), capacity_(capacity), connect_wait_(connect_wait), prepare_(std::move(prepare)) {}

  // Right to use a connection. The destructor returns the connection to the pool, or closes it if it is not usable.
  class Lease {
   public:
    Lease(ConnectionPool& pool, std::unique_ptr<Connection> connection)
        : pool_(&pool), connection_(std::move(connection)) {}
    Lease(Lease&& other) noexcept = default;
    Lease& operator=(Lease&&) = delete;
    ~Lease() {
      if (connection_ != nullptr) pool_->give_back(std::move(connection_));
    }
    Connection& operator*() const { return *connection_; }
    Connection* operator->() const { return connection_.get(); }

   private:
    ConnectionPool* pool_;
    std::unique_ptr<Connection> connection_;
  };

  // Returns a connection. Tries each host once, for at most `connect_wait` each. UNAVAILABLE with the reason of each
  // host if none accepts a connection, or if `deadline` passes before; FAILED_PRECONDITION if `prepare` refuses the
  // engine.
  absl::StatusOr<Lease> acquire(Deadline deadline) LOCUS_EXCLUDES(mutex_);

  // Returns the name of the host that connections go to at present.
  std::string host_name() const LOCUS_EXCLUDES(mutex_);

 private:
  absl::StatusOr<std::unique_ptr<Connection>> connect(Deadline deadline) LOCUS_EXCLUDES(mutex_);
  void give_back(std::unique_ptr<Connection> connection) LOCUS_EXCLUDES(mutex_);

  const EngineAddress address_;
  const size_t capacity_;
  const std::chrono::milliseconds connect_wait_;
  const Prepare prepare_;

  mutable Mutex mutex_;
  ConditionVariable returned_;
  size_t in_use_ LOCUS_GUARDED_BY(mutex_) = 0;  // connections that callers have, or that are being opened
  size_t host_ LOCUS_GUARDED_BY(mutex_) = 0;    // host to try first
  std::vector<std::unique_ptr<Connection>> idle_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_CONNECTION_POOL_H_
