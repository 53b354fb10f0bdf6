#include "server/scheduling/lifetime_keeper.h"

#include <algorithm>

#include "core/base/check.h"

namespace locus::server {

LifetimeKeeper::~LifetimeKeeper() { stop(); }

void LifetimeKeeper::start() {
  LOCUS_CHECK(!thread_.joinable());
  thread_ = std::thread([this] { run(); });
}

void LifetimeKeeper::stop() {
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

LifetimeKeeper::TaskId LifetimeKeeper::add(Time first, Task task) {
  auto shared = std::make_shared<const Task>(std::move(task));
  const MutexLock lock(mutex_);
  const TaskId id = ++last_id_;
  entries_.emplace(id, Entry{std::move(shared), first, false});
  due_.emplace(first, id);
  if (due_.begin()->second == id) changed_.notify_all();
  LOCUS_DCHECK_CALL(check_invariants());
  return id;
}

void LifetimeKeeper::expedite(TaskId id, Time time) {
  const MutexLock lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end() || entry->second.due <= time) return;
  if (!entry->second.running) {
    due_.erase({entry->second.due, id});
    due_.emplace(time, id);
    if (due_.begin()->second == id) changed_.notify_all();
  }
  entry->second.due = time;
  LOCUS_DCHECK_CALL(check_invariants());
}

void LifetimeKeeper::remove(TaskId id) {
  std::shared_ptr<const Task> removed;  // destroyed after the lock is released
  const MutexLock lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return;
  removed = std::move(entry->second.task);
  if (!entry->second.running) due_.erase({entry->second.due, id});
  entries_.erase(entry);
  LOCUS_DCHECK_CALL(check_invariants());
}

size_t LifetimeKeeper::size() const {
  const MutexLock lock(mutex_);
  return entries_.size();
}

std::optional<std::pair<LifetimeKeeper::TaskId, std::shared_ptr<const LifetimeKeeper::Task>>> LifetimeKeeper::take_due(
    Time now) {
  const MutexLock lock(mutex_);
  if (ended_ || due_.empty() || due_.begin()->first > now) return std::nullopt;
  const TaskId id = due_.begin()->second;
  due_.erase(due_.begin());
  Entry& entry = entries_.at(id);
  entry.running = true;
  entry.due = Time::max();
  LOCUS_DCHECK_CALL(check_invariants());
  return std::pair(id, entry.task);
}

// Schedules the next call of a task whose call has ended, at `next` or at an earlier time of expedite().
void LifetimeKeeper::finish(TaskId id, Time now, std::optional<Time> next) {
  std::shared_ptr<const Task> ended;  // destroyed after the lock is released
  const MutexLock lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return;
  entry->second.running = false;
  if (!next) {
    ended = std::move(entry->second.task);
    entries_.erase(entry);
  } else {
    entry->second.due = std::max(std::min(*next, entry->second.due), now + kMinInterval);
    due_.emplace(entry->second.due, id);
  }
  LOCUS_DCHECK_CALL(check_invariants());
}

void LifetimeKeeper::run_due() {
  const Time now = clock_();
  while (const auto task = take_due(now)) finish(task->first, now, (*task->second)(now));
}

void LifetimeKeeper::run() {
  while (true) {
    {
      const MutexLock lock(mutex_);
      while (!ended_ && (due_.empty() || due_.begin()->first > clock_())) {
        if (due_.empty() || due_.begin()->first == Time::max())
          changed_.wait(mutex_);
        else
          changed_.wait_until(mutex_, due_.begin()->first);
      }
      if (ended_) return;
    }
    run_due();
  }
}

void LifetimeKeeper::check_invariants() const {
  LOCUS_CHECK_LE(due_.size(), entries_.size());
  if (!due_.empty()) LOCUS_CHECK(entries_.contains(due_.begin()->second));
}

}  // namespace locus::server
