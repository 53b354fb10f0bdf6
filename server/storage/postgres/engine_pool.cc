#include "server/storage/postgres/engine_pool.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/planted_bug.h"
#include "core/base/status_macros.h"

namespace locus::server {

absl::StatusOr<EnginePool::Lease> EnginePool::acquire(Use use, Deadline deadline) {
  {
    MutexLock lock(mutex_);
    while (in_use(use) >= capacity(use)) {
      if (!returned_.wait_until(mutex_, deadline) && in_use(use) >= capacity(use))
        return absl::UnavailableError(absl::StrCat("all ", capacity(use), " connections to the engine are in use"));
    }
    ++in_use(use);
    if (!idle_.empty()) {
      std::unique_ptr<EngineConnection> connection = std::move(idle_.back());
      idle_.pop_back();
      return Lease(*this, use, std::move(connection));
    }
  }
  absl::StatusOr<std::unique_ptr<EngineConnection>> connection = connect(deadline);
  if (connection.ok()) return Lease(*this, use, *std::move(connection));
  MutexLock lock(mutex_);
  --in_use(use);
  returned_.notify_all();
  return connection.status();
}

absl::StatusOr<std::unique_ptr<EngineConnection>> EnginePool::connect(Deadline deadline) {
  size_t first = 0;
  {
    MutexLock lock(mutex_);
    first = host_;
  }
  std::vector<std::string> reasons;
  absl::Status refusal;  // of a host that accepts writes but whose settings are wrong; another one may be the primary
  for (size_t tried = 0; tried < address_.host_count(); ++tried) {
    const size_t host = (first + tried) % address_.host_count();
    const Deadline until = std::min(deadline, std::chrono::steady_clock::now() + connect_wait_);
    absl::StatusOr<std::unique_ptr<EngineConnection>> connection = EngineConnection::open(address_, host, until);
    absl::Status status = connection.status();
    if (status.ok()) status = prepare_(**connection, until);
    const bool late = std::chrono::steady_clock::now() >= deadline;
    MutexLock lock(mutex_);
    if (status.ok()) {
      host_ = host;
      return connection;
    }
    // The next call begins after the hosts that have used up the time of this one.
    if (late) host_ = (host + 1) % address_.host_count();
    if (absl::IsFailedPrecondition(status)) refusal = status;
    reasons.emplace_back(status.message());
    if (late) break;
  }
  RETURN_IF_ERROR(refusal);
  return absl::UnavailableError(absl::StrCat("no host of the engine accepts writes: ", absl::StrJoin(reasons, "; ")));
}

void EnginePool::give_back(Use use, std::unique_ptr<EngineConnection> connection) {
  std::vector<std::unique_ptr<EngineConnection>> closed;  // closed without the lock
  MutexLock lock(mutex_);
  --in_use(use);
  if (connection->lost() && connection->host() == host_ && !planted(PlantedBug::kEngineHostKept)) {
    host_ = (host_ + 1) % address_.host_count();
    closed.swap(idle_);
  }
  if (connection->usable() && connection->host() == host_) {
    idle_.push_back(std::move(connection));
  } else {
    closed.push_back(std::move(connection));
  }
  returned_.notify_all();
}

std::string EnginePool::host_name() const {
  MutexLock lock(mutex_);
  return address_.host_name(host_);
}

}  // namespace locus::server
