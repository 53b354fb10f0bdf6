#include "server/scheduling/worker_pool.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "core/base/check.h"
#include "core/base/limits.h"

namespace locus::server {

// One call of parallel_for(). A helper that starts after the loop's end finds no index left and does not use `fn_`,
// which may be destroyed by then.
class WorkerPool::Batch {
 public:
  Batch(size_t n, const std::function<void(size_t)>& fn) : n_(n), fn_(&fn) {}

  void work() {
    size_t done = 0;
    for (size_t i = next_.fetch_add(1); i < n_; i = next_.fetch_add(1), ++done) (*fn_)(i);
    if (done == 0) return;
    MutexLock lock(mutex_);
    done_ += done;
    LOCUS_DCHECK_LE(done_, n_);
    if (done_ == n_) all_done_.notify_all();
  }

  void wait() {
    MutexLock lock(mutex_);
    while (done_ < n_) all_done_.wait(mutex_);
  }

 private:
  const size_t n_;
  const std::function<void(size_t)>* const fn_;
  std::atomic<size_t> next_{0};
  Mutex mutex_;
  ConditionVariable all_done_;
  size_t done_ LOCUS_GUARDED_BY(mutex_) = 0;
};

WorkerPool::WorkerPool(uint32_t threads) {
  LOCUS_CHECK_LE(1u, threads);
  LOCUS_CHECK_LE(threads, limits::kMaxThreads);
  for (uint32_t i = 1; i < threads; ++i) helpers_.emplace_back([this] { run_helper(); });
}

WorkerPool::~WorkerPool() {
  {
    MutexLock lock(mutex_);
    ended_ = true;
    work_.notify_all();
  }
  for (std::thread& helper : helpers_) helper.join();
}

void WorkerPool::parallel_for(size_t n, const std::function<void(size_t)>& fn) {
  const size_t helpers = std::min(helpers_.size(), n == 0 ? 0 : n - 1);
  if (helpers == 0) {
    for (size_t i = 0; i < n; ++i) fn(i);
    return;
  }
  const auto batch = std::make_shared<Batch>(n, fn);
  wake_helpers(batch, helpers);
  batch->work();
  batch->wait();
}

void WorkerPool::wake_helpers(const std::shared_ptr<Batch>& batch, size_t helpers) {
  MutexLock lock(mutex_);
  for (size_t i = 0; i < helpers && waiting_.size() < limits::kMaxWaitingBatches; ++i) {
    waiting_.push_back(batch);
    LOCUS_DCHECK_LE(waiting_.size(), limits::kMaxWaitingBatches);
    work_.notify_one();
  }
}

void WorkerPool::run_helper() {
  while (true) {
    std::shared_ptr<Batch> batch;
    {
      MutexLock lock(mutex_);
      while (waiting_.empty() && !ended_) work_.wait(mutex_);
      if (waiting_.empty()) return;
      batch = std::move(waiting_.front());
      waiting_.pop_front();
    }
    batch->work();
  }
}

}  // namespace locus::server
