// A bounded number of connections to the engine, shared by threads. Appends have connections of their own, so that they
// never wait for a snapshot that is being sent. Connections go to the last host that accepted writes. If a
// connection is lost, later ones try the next hosts first: an isolated old primary still accepts connections, and a
// client that returns to it would wait for ever.
//
// Threads: any thread. acquire() waits for a free connection, or for a host to accept one; no lock is held while
// connecting. Invariant: at most kUrgentConnections and kOtherConnections connections are in use, and no more than
// their sum idle.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_POOL_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_POOL_H_

#include <array>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "server/storage/postgres/engine_connection.h"

namespace locus::server {

class EnginePool {
 public:
  // Function that checks and prepares each new connection before its first use.
  using Prepare = std::function<absl::Status(EngineConnection&, Deadline)>;

  enum class Use : uint8_t { kUrgent, kOther };  // kUrgent: short calls that must not wait for others, such as appends
  // With fewer connections for appends, an append would often wait for a commit that began just before it.
  static constexpr size_t kUrgentConnections = 4;
  static constexpr size_t kOtherConnections = 2;

  EnginePool(EngineAddress address, std::chrono::milliseconds connect_wait, Prepare prepare)
      : address_(std::move(address)), connect_wait_(connect_wait), prepare_(std::move(prepare)) {}

  // Right to use a connection. The destructor returns the connection to the pool, or closes it if it is not usable.
  class Lease {
   public:
    Lease(EnginePool& pool, Use use, std::unique_ptr<EngineConnection> connection)
        : pool_(&pool), use_(use), connection_(std::move(connection)) {}
    Lease(Lease&& other) noexcept = default;
    Lease& operator=(Lease&&) = delete;
    ~Lease() {
      if (connection_ != nullptr) pool_->give_back(use_, std::move(connection_));
    }
    EngineConnection& operator*() const { return *connection_; }
    EngineConnection* operator->() const { return connection_.get(); }

   private:
    EnginePool* pool_;
    Use use_;
    std::unique_ptr<EngineConnection> connection_;
  };

  // Returns a connection. Tries each host once, for at most `connect_wait` each. UNAVAILABLE with the reason of each
  // host if none accepts a connection, or if `deadline` passes before; FAILED_PRECONDITION if `prepare` refuses the
  // engine.
  absl::StatusOr<Lease> acquire(Use use, Deadline deadline) LOCUS_EXCLUDES(mutex_);

  // Returns the name of the host that connections go to at present.
  std::string host_name() const LOCUS_EXCLUDES(mutex_);

 private:
  absl::StatusOr<std::unique_ptr<EngineConnection>> connect(Deadline deadline) LOCUS_EXCLUDES(mutex_);
  void give_back(Use use, std::unique_ptr<EngineConnection> connection) LOCUS_EXCLUDES(mutex_);
  static constexpr size_t capacity(Use use) { return use == Use::kUrgent ? kUrgentConnections : kOtherConnections; }
  size_t& in_use(Use use) LOCUS_REQUIRES(mutex_) { return in_use_[static_cast<size_t>(use)]; }

  const EngineAddress address_;
  const std::chrono::milliseconds connect_wait_;
  const Prepare prepare_;

  mutable Mutex mutex_;
  ConditionVariable returned_;
  // Connections for each use that callers have, or that are being opened.
  std::array<size_t, 2> in_use_ LOCUS_GUARDED_BY(mutex_) = {};
  size_t host_ LOCUS_GUARDED_BY(mutex_) = 0;  // host to try first
  std::vector<std::unique_ptr<EngineConnection>> idle_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_POOL_H_
