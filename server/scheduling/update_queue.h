// Queue of update batches: one bounded SceneQueue for each scene, emptied in order of arrival by one thread at a time.
// Therefore threads that serve clients never wait for a scene's writer or its readers. A small batch for an idle scene
// is applied by its caller, unless it scans all objects or its ack waits for the disk. Batches whose ack waits for the
// disk are always queued, and the waiting batches of a scene share one sync.
//
// Threads: every member may be called from any thread; post() takes a lock that is held only briefly. Invariants: at
// most one group of batches of a scene is being applied, and batches of a scene never overtake each other. `items` of
// a SceneQueue, and `updates` and `items` of the statistics, count exactly the waiting batches and items.
#ifndef LOCUS_SERVER_SCHEDULING_UPDATE_QUEUE_H_
#define LOCUS_SERVER_SCHEDULING_UPDATE_QUEUE_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <thread>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "core/scene/registry.h"
#include "core/scene/scene.h"

namespace locus::server {

// One posted batch. It must live until done() is called.
class PendingUpdate {
 public:
  virtual ~PendingUpdate() = default;

  virtual const UpdateBatch& batch() const = 0;

  // Returns OK while the batch should be applied. If stop() returns an error (cancelled, deadline passed), the queue
  // passes the error to done() and does not apply the batch.
  virtual absl::Status stop() const = 0;

  // Receives the result. Called once, on any thread, perhaps within post(); must not block. The queue does not use the
  // update afterwards.
  virtual void done(absl::StatusOr<UpdateAck> ack) = 0;
};

// Handling of a batch for a full SceneQueue.
enum class WhenFull : uint8_t {
  kRefuse,  // RESOURCE_EXHAUSTED with a retry delay; for single calls
  kHold,    // accept the batch and return kFull; for streams, which then stop reading until the batch is done
};

// Result of post().
enum class Posted : uint8_t {
  kTaken,  // accepted, perhaps already done
  kFull,   // accepted, but the caller must not post more until this batch is done
};

struct UpdateQueueOptions {
  uint32_t threads = 1;
  uint32_t max_updates = 256;              // maximum number of batches waiting for one scene
  uint64_t max_items = uint64_t{1} << 20;  // limit of items waiting for one scene; one batch alone is always accepted
  uint64_t inline_nanoseconds = 100'000;   // maximum estimated work of a batch that is applied by its caller
};

// Counters of the queue. All counters except `updates` and `items` never decrease.
struct UpdateQueueStats {
  uint64_t updates = 0;         // batches waiting for all scenes
  uint64_t items = 0;           // items of these batches
  uint64_t applied = 0;         // batches applied
  uint64_t applied_inline = 0;  // batches applied by their caller
  uint64_t refused = 0;         // batches refused because the scene's queue was full
  uint64_t held = 0;            // batches accepted with kFull
  uint64_t coalesced = 0;       // batches that share the revision of a later batch
  uint64_t stalls = 0;          // times that a scene waited for its readers to release memory
};

class UpdateQueue {
 public:
  explicit UpdateQueue(const UpdateQueueOptions& options);
  // Returns once every batch is done.
  ~UpdateQueue();
  UpdateQueue(const UpdateQueue&) = delete;
  UpdateQueue& operator=(const UpdateQueue&) = delete;

  // Queues `update`, which is borrowed until done(), or applies it immediately. If post() returns an error, the batch
  // was refused and done() is not called.
  absl::StatusOr<Posted> post(const ScenePtr& scene, PendingUpdate& update, WhenFull when_full) LOCUS_EXCLUDES(mutex_);

  UpdateQueueStats stats() const LOCUS_EXCLUDES(mutex_);
  const UpdateQueueOptions& options() const { return options_; }

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  // A batch and the numbers of its items and lists, which are counted once, without the lock: a batch may consist of
  // thousands of messages.
  struct Waiting {
    PendingUpdate* update = nullptr;
    uint64_t items = 0;
    uint64_t lists = 0;
  };

  // Batches that wait for one scene. A scene is stalled while its readers hold more memory than their budget.
  struct SceneQueue {
    ScenePtr scene;
    std::deque<Waiting> waiting;
    uint64_t items = 0;
    bool busy = false;           // a thread is applying batches
    SteadyTime retry_at = {};    // time of the next attempt, while readers stall the scene
    SteadyTime stalled_at = {};  // start of the stall
    absl::Status late;           // error of the last attempt if readers stalled it, else OK; for the busy thread only
  };
  using Group = std::vector<Waiting>;

  SceneQueue& queue_of(const ScenePtr& scene) LOCUS_REQUIRES(mutex_);
  bool full(const SceneQueue& scene_queue, uint64_t items) const;
  absl::Status refuse(const SceneQueue& scene_queue, uint64_t items) const;
  bool fits_inline(const Scene& scene, const UpdateBatch& batch, uint64_t items) const;
  void apply_inline(SceneQueue& scene_queue, const Waiting& update) LOCUS_EXCLUDES(mutex_);

  void run() LOCUS_EXCLUDES(mutex_);
  SceneQueue* next() LOCUS_EXCLUDES(mutex_);
  void work_on(SceneQueue& scene_queue) LOCUS_EXCLUDES(mutex_);
  Group take_group(SceneQueue& scene_queue) LOCUS_REQUIRES(mutex_);
  void requeue(SceneQueue& scene_queue, const Group& group) LOCUS_REQUIRES(mutex_);
  // Applies the group and calls done() of each of its batches. Returns false if the scene's readers hold too much
  // memory; then `group` contains the batches that were not applied.
  bool apply(SceneQueue& scene_queue, Group& group) LOCUS_EXCLUDES(mutex_);
  void count(const Scene& scene, size_t updates) LOCUS_EXCLUDES(mutex_);
  static void drop_stopped(const SceneQueue& scene_queue, Group& group);
  void stall(SceneQueue& scene_queue, const Group& group) LOCUS_EXCLUDES(mutex_);
  // Ends this thread's work on the SceneQueue. Returns the SceneQueue if it is empty; the caller frees it without the
  // lock, because freeing it may destroy a deleted scene.
  std::unique_ptr<SceneQueue> finish(SceneQueue& scene_queue) LOCUS_REQUIRES(mutex_);
  // Returns whether a batch of the group changes instances. The time of such a batch depends on the number of all
  // instances, so it is not used as the cost of an item.
  static bool changes_instances(const Group& group);
  void learn(uint64_t items, SteadyTime start);
  void check_invariants(const SceneQueue& scene_queue) const LOCUS_REQUIRES(mutex_);

  const UpdateQueueOptions options_;
  mutable Mutex mutex_;
  ConditionVariable work_;
  absl::flat_hash_map<const Scene*, std::unique_ptr<SceneQueue>> scene_queues_ LOCUS_GUARDED_BY(mutex_);
  std::deque<SceneQueue*> ready_ LOCUS_GUARDED_BY(mutex_);     // not busy, with waiting batches; each queue once
  std::vector<SceneQueue*> stalled_ LOCUS_GUARDED_BY(mutex_);  // like ready_, but stalled until retry_at
  UpdateQueueStats stats_ LOCUS_GUARDED_BY(mutex_);
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::atomic<double> nanoseconds_per_item_;
  std::vector<std::thread> threads_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_UPDATE_QUEUE_H_
