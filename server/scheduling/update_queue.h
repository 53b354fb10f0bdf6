// The way of update batches into scenes: a bounded mailbox for each scene, emptied in the order of arrival by one
// thread at a time, so that nobody who talks to clients waits for a scene's writer or for its readers. A small batch
// for a scene that nobody else is writing to is applied by whoever brings it, unless its ack waits for the disk: then
// all that wait are logged with one sync.
//
// Threads: every member may be called from any thread; post() takes a lock that is only held for moments. Invariant: of
// one scene at most one batch is being applied, and none overtakes another.
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

// One batch on its way into a scene. Lives until done().
class PendingUpdate {
 public:
  virtual ~PendingUpdate() = default;

  virtual const UpdateBatch& batch() const = 0;

  // OK while somebody still wants it applied; otherwise done() gets this, and the scene stays as it is.
  virtual absl::Status stop() const = 0;

  // What became of it. Called once, on any thread, perhaps within post(); must not block. The pump never touches the
  // update again.
  virtual void done(absl::StatusOr<UpdateAck> ack) = 0;
};

// What becomes of a batch for a full mailbox.
enum class WhenFull : uint8_t {
  kRefuse,  // RESOURCE_EXHAUSTED with a time to try again: for whoever may send anything at any time
  kHold,    // taken all the same; for streams, which then read no more until it is done
};

enum class Posted : uint8_t {
  kTaken,  // or already done
  kFull,   // taken, but bring no more until it is done
};

struct UpdateQueueOptions {
  uint32_t threads = 1;
  uint32_t max_updates = 256;              // that wait in one mailbox
  uint64_t max_items = uint64_t{1} << 20;  // of them; one is taken however many it has
  uint64_t inline_nanoseconds = 100'000;   // what whoever brings a batch may spend on it, as estimated
};

// Plain numbers; all but the first two only grow.
struct UpdatePumpStats {
  uint64_t updates = 0;  // waiting in all mailboxes
  uint64_t items = 0;    // of them
  uint64_t applied = 0;
  uint64_t applied_inline = 0;
  uint64_t refused = 0;    // for a full mailbox
  uint64_t held = 0;       // that were told kFull
  uint64_t coalesced = 0;  // that became visible only together with a later one
  uint64_t stalls = 0;     // times that a scene's readers made its mailbox wait
};

class UpdateQueue {
 public:
  explicit UpdateQueue(const UpdateQueueOptions& options);
  // Until every batch is done.
  ~UpdateQueue();
  UpdateQueue(const UpdateQueue&) = delete;
  UpdateQueue& operator=(const UpdateQueue&) = delete;

  // `update` is borrowed until done(). An error is a refusal, and done() is not called.
  absl::StatusOr<Posted> post(const ScenePtr& scene, PendingUpdate& update, WhenFull when_full) LOCUS_EXCLUDES(mutex_);

  UpdatePumpStats stats() const LOCUS_EXCLUDES(mutex_);
  const UpdateQueueOptions& options() const { return options_; }

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  struct SceneQueue {
    ScenePtr scene;
    std::deque<PendingUpdate*> waiting;
    uint64_t items = 0;
    bool at_work = false;        // somebody applies
    SteadyTime retry_at = {};    // readers make it wait until then ...
    SteadyTime stalled_at = {};  // ... since this moment
    absl::Status late;           // and what they hold; of whoever is at work
  };
  using Group = std::vector<PendingUpdate*>;

  SceneQueue& mailbox_of(const ScenePtr& scene) LOCUS_REQUIRES(mutex_);
  bool full(const SceneQueue& scene_queue, uint64_t items) const;
  absl::Status refuse(const SceneQueue& scene_queue, uint64_t items) const;
  bool fits_inline(const Scene& scene, const UpdateBatch& batch, uint64_t items) const;
  void apply_here(SceneQueue& scene_queue, PendingUpdate& update, uint64_t items) LOCUS_EXCLUDES(mutex_);

  void run() LOCUS_EXCLUDES(mutex_);
  SceneQueue* next() LOCUS_EXCLUDES(mutex_);
  void work_on(SceneQueue& scene_queue) LOCUS_EXCLUDES(mutex_);
  Group take_group(SceneQueue& scene_queue) LOCUS_REQUIRES(mutex_);
  void put_back(SceneQueue& scene_queue, const Group& group) LOCUS_REQUIRES(mutex_);
  // Applies and reports. False where the scene's readers hold it up; then `group` has those that still wait.
  bool apply(SceneQueue& scene_queue, Group& group) LOCUS_EXCLUDES(mutex_);
  void count(const Scene& scene, size_t updates) LOCUS_EXCLUDES(mutex_);
  static void drop_stopped(const SceneQueue& scene_queue, Group& group);
  void stall(SceneQueue& scene_queue, const Group& group) LOCUS_EXCLUDES(mutex_);
  // The mailbox where it is empty: to be freed without the lock, since a deleted scene may go with it.
  std::unique_ptr<SceneQueue> leave(SceneQueue& scene_queue) LOCUS_REQUIRES(mutex_);
  void learn(uint64_t items, SteadyTime start);

  const UpdateQueueOptions options_;
  mutable Mutex mutex_;
  ConditionVariable work_;
  absl::flat_hash_map<const Scene*, std::unique_ptr<SceneQueue>> scene_queues_ LOCUS_GUARDED_BY(mutex_);
  std::deque<SceneQueue*> ready_ LOCUS_GUARDED_BY(mutex_);     // with batches, nobody at work, each once
  std::vector<SceneQueue*> stalled_ LOCUS_GUARDED_BY(mutex_);  // the same, until their time to retry
  UpdatePumpStats stats_ LOCUS_GUARDED_BY(mutex_);
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::atomic<double> nanoseconds_an_item_;
  std::vector<std::thread> threads_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_UPDATE_QUEUE_H_
