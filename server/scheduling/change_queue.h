// Background work in numbered order: changes of a scene's instances. Jobs of one key run one after another in the order
// of their numbers; jobs of different keys run side by side on a few threads.
//
// Threads: every member may be called from any thread. Invariant: of one key at most one job runs, and none overtakes
// another.
#ifndef LOCUS_SERVER_SCHEDULING_CHANGE_QUEUE_H_
#define LOCUS_SERVER_SCHEDULING_CHANGE_QUEUE_H_

#include <cstdint>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "core/base/mutex.h"

namespace locus::server {

class ChangeQueue {
 public:
  using Job = std::function<void(uint64_t number)>;

  // Up to `max_waiting` jobs of a key may wait, the running one included.
  ChangeQueue(uint32_t threads, uint32_t max_waiting);
  // Waits for running jobs and drops those not begun.
  ~ChangeQueue();
  ChangeQueue(const ChangeQueue&) = delete;
  ChangeQueue& operator=(const ChangeQueue&) = delete;

  // The job's number within its key, counted from 1. RESOURCE_EXHAUSTED naming pending_changes when the key's queue is
  // full.
  absl::StatusOr<uint64_t> submit(uint64_t key, Job job) LOCUS_EXCLUDES(mutex_);

  // Jobs of the key that have not ended.
  uint32_t pending(uint64_t key) const LOCUS_EXCLUDES(mutex_);

  // Drops the key's count once its jobs have ended: for keys that never come again.
  void forget(uint64_t key) LOCUS_EXCLUDES(mutex_);

 private:
  struct Line {
    uint64_t last_number = 0;
    bool running = false;
    bool forgotten = false;
    std::deque<Job> waiting;  // the last has the number last_number
  };

  void run() LOCUS_EXCLUDES(mutex_);
  void finish(uint64_t key) LOCUS_EXCLUDES(mutex_);

  const uint32_t max_waiting_;
  mutable Mutex mutex_;
  ConditionVariable work_;
  absl::flat_hash_map<uint64_t, Line> lines_ LOCUS_GUARDED_BY(mutex_);
  std::deque<uint64_t> ready_ LOCUS_GUARDED_BY(mutex_);  // keys with waiting jobs and none running, each once
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_CHANGE_QUEUE_H_
