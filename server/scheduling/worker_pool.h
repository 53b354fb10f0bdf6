// Thread pool for parallel_for(), used for building trees. The calling thread runs a part of the loop itself, so the
// loop ends even if every helper is busy or the queue is full.
//
// Threads: parallel_for() may be called from any number of threads at the same time, and from within its own loop body.
// Invariant: fn is called exactly once for each index below n, and all calls have returned when parallel_for() returns.
#ifndef LOCUS_SERVER_SCHEDULING_WORKER_POOL_H_
#define LOCUS_SERVER_SCHEDULING_WORKER_POOL_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "core/base/mutex.h"

namespace locus::server {

class WorkerPool {
 public:
  // Starts `threads` - 1 helpers: with the caller, `threads` threads run one loop.
  explicit WorkerPool(uint32_t threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  uint32_t threads() const { return static_cast<uint32_t>(helpers_.size()) + 1; }

  // Calls fn(0) .. fn(n - 1), in any order, on this thread and on free helpers; returns when all calls have returned.
  // The writes of fn are then visible to the caller. `fn` must not throw.
  void parallel_for(size_t n, const std::function<void(size_t)>& fn) LOCUS_EXCLUDES(mutex_);

 private:
  class Batch;

  void run_helper() LOCUS_EXCLUDES(mutex_);
  void wake_helpers(const std::shared_ptr<Batch>& batch, size_t helpers) LOCUS_EXCLUDES(mutex_);

  Mutex mutex_;
  ConditionVariable work_;
  std::deque<std::shared_ptr<Batch>> waiting_ LOCUS_GUARDED_BY(mutex_);  // each Batch once for each helper it may use
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> helpers_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_WORKER_POOL_H_
