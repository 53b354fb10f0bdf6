#include "server/scheduling/thread_group.h"

#include <system_error>
#include <utility>

namespace locus::server {

bool ThreadGroup::start(std::function<void()> task) {
  Threads ended;
  bool started = false;
  {
    MutexLock lock(mutex_);
    ended.swap(ended_);
    if (running_.size() < max_) {
      const Threads::iterator self = running_.emplace(running_.end());
      try {
        *self = std::thread([this, self, body = std::move(task)] { run(body, self); });
        started = true;
      } catch (const std::system_error&) {
        running_.erase(self);
      }
    }
  }
  join(std::move(ended));
  return started;
}

// Takes the lock, so it comes here only after start() has stored the thread.
void ThreadGroup::run(const std::function<void()>& task, Threads::iterator self) {
  task();
  MutexLock lock(mutex_);
  ended_.splice(ended_.end(), running_, self);
  one_ended_.notify_all();
}

void ThreadGroup::join_all() {
  Threads ended;
  {
    MutexLock lock(mutex_);
    while (!running_.empty()) one_ended_.wait(mutex_);
    ended.swap(ended_);
  }
  join(std::move(ended));
}

bool ThreadGroup::wait_until_idle(std::chrono::steady_clock::time_point deadline) {
  MutexLock lock(mutex_);
  while (!running_.empty())
    if (!one_ended_.wait_until(mutex_, deadline)) return running_.empty();
  return true;
}

void ThreadGroup::join(Threads threads) {
  for (std::thread& thread : threads) thread.join();
}

size_t ThreadGroup::running() const {
  MutexLock lock(mutex_);
  return running_.size();
}

}  // namespace locus::server
