// Thread that keeps the memory of the process below its limit. It measures the process periodically. When memory is
// short or a claim was refused, it drops old revisions and returns free memory to the kernel. At other times it returns
// free memory that is worth it: soon while the process is mostly idle, and rarely while it is busy, because a return
// visits the whole heap and busy threads would soon take the memory again. When memory is short, the thread
// then drops the oldest ticks of histories, before inserts and uploads have to be refused. After that it cancels the
// readers of the oldest revisions. If memory is nearly full, the thread first closes the connections that claim and
// send most bytes. Only this thread does this work, because the work visits all scenes and the whole heap. The thread
// logs what it dropped, cancelled or closed, which histories forget ticks early, and the lines of the budget on which
// claims were refused. While memory is short or claims are refused, it logs the use of each line once a minute.
//
// Threads: the constructor starts the thread, the destructor ends it.
#ifndef LOCUS_SERVER_HOST_MEMORY_KEEPER_H_
#define LOCUS_SERVER_HOST_MEMORY_KEEPER_H_

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"
#include "core/scene/registry.h"
#include "server/host/history_notices.h"
#include "server/scheduling/memory_budget.h"

namespace locus::server {

// Returns the new maximum sizes of several parts, so that all parts together take `excess` bytes less. Each part is
// shortened in proportion to its size. `sizes` are the present sizes of the parts in bytes.
std::vector<uint64_t> shrunk_sizes(const std::vector<uint64_t>& sizes, uint64_t excess);

class MemoryKeeper {
 public:
  // Function that closes the connections that claim and send most bytes. Sent bytes count, because they use memory
  // inside gRPC that no claim includes. If `close` is false, the function only measures the sent bytes. Returns the
  // number of closed connections.
  using Shed = std::function<size_t(bool close)>;

  // `budget`, `registry` and `log` must outlive the keeper. `log` may be null.
  MemoryKeeper(MemoryBudget& budget, Registry& registry, Shed shed, const UpdateLog* log = nullptr);
  ~MemoryKeeper();
  MemoryKeeper(const MemoryKeeper&) = delete;
  MemoryKeeper& operator=(const MemoryKeeper&) = delete;

  // Measures the process, and frees memory if memory is short, a claim was refused, or the allocator keeps much free
  // memory. Called by the thread and by tests.
  void keep();

  // Returns the number of bytes by which histories were shortened so far.
  uint64_t trimmed_bytes() const { return trimmed_bytes_.load(); }
  // Returns the sum of the bytes that the cancelled readers had held, over all readers cancelled so far.
  uint64_t revoked_bytes() const { return revoked_bytes_.load(); }

 private:
  void run() LOCUS_EXCLUDES(mutex_);
  // Drops all revisions of each scene except the latest one, and returns free memory to the kernel.
  void release_needed();
  // Returns free memory to the kernel if it has become more than spare_ceiling() since the last return. Does nothing if
  // the last call is too recent; this depends on how busy the process was meanwhile.
  void release_spare(std::chrono::steady_clock::time_point now);
  void trim_histories(uint64_t excess);
  void shed_connections();
  void revoke_readers();
  void log_refusals(std::chrono::steady_clock::time_point now);
  void log_lines(std::chrono::steady_clock::time_point now);

  MemoryBudget& budget_;
  Registry& registry_;
  const Shed shed_;
  const UpdateLog* const log_;
  std::atomic<uint64_t> trimmed_bytes_{0};
  std::atomic<uint64_t> revoked_bytes_{0};
  // Used by the thread only.
  std::chrono::steady_clock::time_point last_release_{}, last_readers_{}, last_refusals_{}, last_lines_{};
  std::chrono::steady_clock::time_point last_load_{}, last_check_{}, next_check_{};
  std::chrono::nanoseconds cpu_at_load_{0};  // processor time of the process at last_load_
  // Least reusable bytes since the last return of free memory, which could not return these bytes.
  uint64_t unreturned_ = std::numeric_limits<uint64_t>::max();
  bool refused_ = false;  // a claim was refused since the last release
  std::array<uint64_t, kMemoryLines> logged_refusals_{};
  std::chrono::steady_clock::time_point last_notices_{};
  HistoryNotices history_notices_;
  Mutex mutex_;
  ConditionVariable ended_changed_;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_MEMORY_KEEPER_H_
