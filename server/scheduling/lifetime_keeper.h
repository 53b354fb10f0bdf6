// Thread that calls tasks at their times: deletes idle scenes (idle_scenes.h), collects unused meshes
// (mesh_collector.h) and ends leases (lease_keeper.h). A task returns the time of its next call, so that an event that
// postpones a deadline, such as a call that uses a scene, need not tell the keeper: the task is called at the old time
// and returns the new one. The thread sleeps until the next task is due.
//
// Threads: every member may be called from any thread, start() once. Tasks are called one after another without a lock,
// and may call every member but the destructor. Invariants: every task that is not being called has exactly one entry
// in `due_`; each task is called at most once for each time that it returned.
#ifndef LOCUS_SERVER_SCHEDULING_LIFETIME_KEEPER_H_
#define LOCUS_SERVER_SCHEDULING_LIFETIME_KEEPER_H_

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/base/mutex.h"

namespace locus::server {

class LifetimeKeeper {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Clock = std::function<Time()>;
  // Receives the present time. Returns the time of the next call, or nullopt if the task has ended.
  using Task = std::function<std::optional<Time>(Time now)>;
  using TaskId = uint64_t;

  // Minimum time between the start of a round of calls and the next call of a task of this round.
  static constexpr std::chrono::milliseconds kMinInterval{1};

  // `clock` replaces the steady clock in tests that do not call start().
  explicit LifetimeKeeper(Clock clock = &std::chrono::steady_clock::now) : clock_(std::move(clock)) {}
  // Waits for the call of a task that is running.
  ~LifetimeKeeper();
  LifetimeKeeper(const LifetimeKeeper&) = delete;
  LifetimeKeeper& operator=(const LifetimeKeeper&) = delete;

  // Starts the thread. Until then tasks are called only by run_due().
  void start() LOCUS_EXCLUDES(mutex_);
  // Ends the thread. Tasks are not called any more.
  void stop() LOCUS_EXCLUDES(mutex_);

  Time now() const { return clock_(); }

  // Adds a task that is called at `first`. Returns its id, which is never reused.
  TaskId add(Time first, Task task) LOCUS_EXCLUDES(mutex_);
  // Makes the next call of a task at `time`, if it would be later. A task that is being called is called again at
  // `time`. Does nothing if the task has ended.
  void expedite(TaskId id, Time time) LOCUS_EXCLUDES(mutex_);
  // Removes a task: no further call begins. A call that is running continues.
  void remove(TaskId id) LOCUS_EXCLUDES(mutex_);
  // Returns the number of tasks.
  size_t size() const LOCUS_EXCLUDES(mutex_);

  // Calls the tasks that are due. Called by the thread, and by tests without a thread.
  void run_due() LOCUS_EXCLUDES(mutex_);

 private:
  struct Entry {
    std::shared_ptr<const Task> task;
    Time due = Time::max();
    bool running = false;
  };
  using Entries = absl::flat_hash_map<TaskId, Entry>;

  void run() LOCUS_EXCLUDES(mutex_);
  // Returns a task that is due at `now` and marks it as running, or nullopt if there is none.
  std::optional<std::pair<TaskId, std::shared_ptr<const Task>>> take_due(Time now) LOCUS_EXCLUDES(mutex_);
  void finish(TaskId id, Time now, std::optional<Time> next) LOCUS_EXCLUDES(mutex_);
  void check_invariants() const LOCUS_REQUIRES(mutex_);

  const Clock clock_;
  mutable Mutex mutex_;
  ConditionVariable changed_;
  Entries entries_ LOCUS_GUARDED_BY(mutex_);
  std::set<std::pair<Time, TaskId>> due_ LOCUS_GUARDED_BY(mutex_);
  TaskId last_id_ LOCUS_GUARDED_BY(mutex_) = 0;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_LIFETIME_KEEPER_H_
