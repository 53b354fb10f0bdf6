// Threads that help a caller through a list of independent pieces of work, such as the chunks of a query batch. The
// caller takes part, so work is done even when every helper is busy or the queue is full.
//
// Threads: parallel_for() may be called from any number of threads at once, also from within a piece of work.
// Invariant: each number below n is given to fn exactly once, and none is in work when parallel_for() returns.
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
  // `threads` may work on one list, the caller included: one thread less is started.
  explicit WorkerPool(uint32_t threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  uint32_t threads() const { return static_cast<uint32_t>(helpers_.size()) + 1; }

  // Calls fn(0) .. fn(n - 1), in no order, on this thread and on helpers that are free; returns when all have. What one
  // call wrote is visible to the caller afterwards. `fn` must not throw.
  void parallel_for(size_t n, const std::function<void(size_t)>& fn) LOCUS_EXCLUDES(mutex_);

 private:
  class Batch;

  void help() LOCUS_EXCLUDES(mutex_);
  void ask_for_help(const std::shared_ptr<Batch>& batch, size_t helpers) LOCUS_EXCLUDES(mutex_);

  Mutex mutex_;
  ConditionVariable work_;
  std::deque<std::shared_ptr<Batch>> waiting_ LOCUS_GUARDED_BY(mutex_);  // one entry for each helper it could use
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> helpers_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_WORKER_POOL_H_
