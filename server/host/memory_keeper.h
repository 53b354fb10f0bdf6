// Thread that keeps the memory of the process below its limit. It measures the process periodically. When memory is
// short or a claim was refused, it drops old revisions and returns free memory to the kernel. When memory is short, it
// then drops the oldest ticks of histories, before inserts and uploads have to be refused. After that it cancels the
// readers of the oldest revisions. If memory is nearly full, the thread first closes the connections that claim and
// send most bytes. Only this thread does this work, because the work visits all scenes and the whole heap. The thread
// logs what it dropped, cancelled or closed, and the lines of the budget on which claims were refused. While memory is
// short or claims are refused, it logs the use of each line once a minute.
//
// Threads: the constructor starts the thread, the destructor ends it.
#ifndef LOCUS_SERVER_HOST_MEMORY_KEEPER_H_
#define LOCUS_SERVER_HOST_MEMORY_KEEPER_H_

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"
#include "core/scene/registry.h"
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
  // Returns free memory to the kernel. If memory is needed, first drops all revisions of each scene except the latest
  // one; otherwise does nothing unless much memory is free.
  void release(bool is_needed);
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
  bool refused_ = false;  // a claim was refused since the last release
  std::array<uint64_t, kMemoryLines> logged_refusals_{};
  Mutex mutex_;
  ConditionVariable ended_changed_;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_MEMORY_KEEPER_H_
