// Threads for calls that block: each task starts immediately, on an idle thread or on a new one. No queue is needed,
// because the admission of calls limits the number of tasks. A few idle threads are kept for later tasks. Each returns
// its free memory to the system when it has been idle for a while: see return_top_of_arena().
//
// Threads: run() may be called from any thread. Invariant: at most max() threads exist.
#ifndef LOCUS_SERVER_SCHEDULING_CALL_THREADS_H_
#define LOCUS_SERVER_SCHEDULING_CALL_THREADS_H_

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <thread>

#include "core/base/mutex.h"

namespace locus::server {

class CallThreads {
 public:
  explicit CallThreads(uint32_t max) : max_(max) {}
  // Waits for all running tasks.
  ~CallThreads();
  CallThreads(const CallThreads&) = delete;
  CallThreads& operator=(const CallThreads&) = delete;

  uint32_t max() const { return max_; }

  // Runs `task` soon on a thread of its own. Returns false, without running it, if max() tasks are running already or
  // the system has no thread left.
  bool run(std::function<void()> task) LOCUS_EXCLUDES(mutex_);

 private:
  // Maximum number of idle threads that are kept.
  static constexpr size_t kMaxIdle = 16;
  // Time after the end of its last task when a thread returns its free memory.
  static constexpr std::chrono::seconds kRest{2};
  using Threads = std::list<std::thread>;

  void work(Threads::iterator self) LOCUS_EXCLUDES(mutex_);
  void join_ended() LOCUS_REQUIRES(mutex_);
  void check_invariants() const LOCUS_REQUIRES(mutex_);

  const uint32_t max_;
  Mutex mutex_;
  ConditionVariable changed_;
  std::deque<std::function<void()>> waiting_ LOCUS_GUARDED_BY(mutex_);  // tasks that an idle thread is about to take
  Threads threads_ LOCUS_GUARDED_BY(mutex_);
  Threads ended_threads_ LOCUS_GUARDED_BY(mutex_);  // threads that are returning, to be joined
  size_t idle_ LOCUS_GUARDED_BY(mutex_) = 0;
  bool ending_ LOCUS_GUARDED_BY(mutex_) = false;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_CALL_THREADS_H_
