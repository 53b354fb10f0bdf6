#include "server/scheduling/call_threads.h"

#include <system_error>
#include <utility>

#include "core/base/check.h"
#include "server/scheduling/allocator_use.h"

namespace locus::server {

CallThreads::~CallThreads() {
  MutexLock lock(mutex_);
  ending_ = true;
  changed_.notify_all();
  while (!threads_.empty()) changed_.wait(mutex_);
  join_ended();
}

bool CallThreads::run(std::function<void()> task) {
  MutexLock lock(mutex_);
  join_ended();
  if (idle_ <= waiting_.size()) {
    if (threads_.size() >= max_) return false;
    threads_.emplace_back();
    const auto self = std::prev(threads_.end());
    try {  // std::thread throws only if the system has no thread left
      *self = std::thread([this, self] { work(self); });
    } catch (const std::system_error&) {
      threads_.erase(self);
      return false;
    }
    ++idle_;
  }
  waiting_.push_back(std::move(task));
  changed_.notify_all();
  LOCUS_DCHECK_CALL(check_invariants());
  return true;
}

void CallThreads::work(Threads::iterator self) {
  MutexLock lock(mutex_);
  bool rested = true;  // the thread has returned its free memory since its last task
  auto rest_at = std::chrono::steady_clock::now();
  while (true) {
    while (waiting_.empty() && !ending_ && idle_ <= kMaxIdle) {
      if (rested) {
        changed_.wait(mutex_);
      } else if (!changed_.wait_until(mutex_, rest_at)) {
        rested = true;
        mutex_.unlock();
        return_top_of_arena();
        mutex_.lock();
      }
    }
    if (waiting_.empty()) break;
    std::function<void()> task = std::move(waiting_.front());
    waiting_.pop_front();
    --idle_;
    mutex_.unlock();
    task();
    task = nullptr;
    mutex_.lock();
    ++idle_;
    rested = false;
    rest_at = std::chrono::steady_clock::now() + kRest;
  }
  --idle_;
  ended_threads_.splice(ended_threads_.end(), threads_, self);
  changed_.notify_all();
}

// Joins the threads that have returned from work() or are about to return.
void CallThreads::join_ended() {
  Threads ended = std::move(ended_threads_);
  ended_threads_.clear();
  mutex_.unlock();
  for (std::thread& thread : ended) thread.join();
  mutex_.lock();
}

void CallThreads::check_invariants() const {
  LOCUS_CHECK_LE(threads_.size(), size_t{max_});
  LOCUS_CHECK_LE(idle_, threads_.size());
  LOCUS_CHECK_LE(waiting_.size(), idle_);
}

}  // namespace locus::server
