// A bounded number of threads, each with one long task: an open stream. Ended threads are collected when the next one
// starts, so that a server that lives for months holds no more of them than are running.
//
// Threads: every member may be called from any thread but the group's own.
#ifndef LOCUS_SERVER_SCHEDULING_THREAD_GROUP_H_
#define LOCUS_SERVER_SCHEDULING_THREAD_GROUP_H_

#include <chrono>
#include <cstddef>
#include <functional>
#include <list>
#include <thread>

#include "core/base/mutex.h"

namespace locus::server {

class ThreadGroup {
 public:
  explicit ThreadGroup(size_t max) : max_(max) {}
  // Waits for every task to end.
  ~ThreadGroup() { join_all(); }
  ThreadGroup(const ThreadGroup&) = delete;
  ThreadGroup& operator=(const ThreadGroup&) = delete;

  // False, and `task` is not run, when as many threads as may are running or the system has none left.
  bool start(std::function<void()> task) LOCUS_EXCLUDES(mutex_);

  // Waits until no task runs. Tasks must have been told to end by other means.
  void join_all() LOCUS_EXCLUDES(mutex_);

  // As join_all(), but false when a task still runs at `deadline`.
  bool wait_until_idle(std::chrono::steady_clock::time_point deadline) LOCUS_EXCLUDES(mutex_);

  size_t running() const LOCUS_EXCLUDES(mutex_);
  size_t max() const { return max_; }

 private:
  using Threads = std::list<std::thread>;

  void run(const std::function<void()>& task, Threads::iterator self) LOCUS_EXCLUDES(mutex_);
  static void join(Threads threads);

  const size_t max_;
  mutable Mutex mutex_;
  ConditionVariable one_ended_;
  Threads running_ LOCUS_GUARDED_BY(mutex_);
  Threads ended_ LOCUS_GUARDED_BY(mutex_);  // past their task, to be joined
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_THREAD_GROUP_H_
