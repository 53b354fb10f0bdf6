// Queue of numbered background jobs, used for changes of a scene's instances. Jobs of one key run one after another in
// the order of their numbers; jobs of different keys run concurrently on a few threads.
//
// Threads: every member may be called from any thread. Invariant: at most one job of a key runs, and jobs of a key
// never overtake each other.
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

  // Starts `threads` threads. Each key may have `max_waiting` jobs, including its running job.
  ChangeQueue(uint32_t threads, uint32_t max_waiting);
  // Waits for running jobs and drops all waiting jobs.
  ~ChangeQueue();
  ChangeQueue(const ChangeQueue&) = delete;
  ChangeQueue& operator=(const ChangeQueue&) = delete;

  // Queues the job and returns its number within the key, counted from 1. Returns RESOURCE_EXHAUSTED, naming the limit
  // pending_changes, if the key has `max_waiting` jobs.
  absl::StatusOr<uint64_t> submit(uint64_t key, Job job) LOCUS_EXCLUDES(mutex_);

  // Returns the number of waiting and running jobs of the key.
  uint32_t pending(uint64_t key) const LOCUS_EXCLUDES(mutex_);

  // Deletes the counter of the key's job numbers once the key's jobs have ended. Call it for keys that are never used
  // again.
  void forget(uint64_t key) LOCUS_EXCLUDES(mutex_);

 private:
  struct KeyQueue {
    uint64_t last_number = 0;
    bool running = false;
    bool forgotten = false;
    std::deque<Job> waiting;  // jobs that have not started; the last job has the number last_number
  };

  void run() LOCUS_EXCLUDES(mutex_);
  void finish(uint64_t key) LOCUS_EXCLUDES(mutex_);
  void check_invariants(uint64_t key) const LOCUS_REQUIRES(mutex_);

  const uint32_t max_waiting_;
  mutable Mutex mutex_;
  ConditionVariable work_;
  absl::flat_hash_map<uint64_t, KeyQueue> queues_ LOCUS_GUARDED_BY(mutex_);
  std::deque<uint64_t> ready_ LOCUS_GUARDED_BY(mutex_);  // keys with waiting jobs and no running job, each key once
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_CHANGE_QUEUE_H_
