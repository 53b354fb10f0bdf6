// Scene: a named world with its latest snapshot, its single writer, and the callers that wait for a revision.
//
// A scene with a log appends a record before it applies a change, and applies the change only if the append succeeded.
// The result depends only on the state before and on the record, so that a replay makes the same revisions, acks and
// refusals: see core/scene/recovery.h. A record may have no effect.
//
// Threads: every member may be called from any thread. apply...() and change_instances() are serialised inside, and
// wait for the log; latest() and view() never wait for the writer or the log, except for a revision that is asked for:
// they take a lock only to copy a pointer, and the writer holds that lock only to replace it. Invariants: the revisions
// of a scene are published in order without gaps, each after it is complete, with the writer's epoch; ticks never
// decrease unless a batch restarts them; a published snapshot never changes; no change is published or acknowledged
// before it is logged.
#ifndef LOCUS_CORE_SCENE_SCENE_H_
#define LOCUS_CORE_SCENE_SCENE_H_

#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <string>

#include "core/base/mutex.h"
#include "core/scene/log/scene_journal.h"
#include "core/scene/log/scene_state.h"
#include "core/scene/readers/reader_tracker.h"
#include "core/scene/scene_writer.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// Treatment of update batches that arrive faster than they can be applied.
enum class OverloadPolicy : uint8_t {
  kEveryBatch,  // each batch is a revision of its own; senders wait
  kLatestWins,  // queued batches that only move objects at one tick become one revision
};

// Durability of an update at the time of its acknowledgement, for a scene with a log.
enum class Durability : uint8_t {
  kLocal,   // synced to this machine's disk
  kMemory,  // to be synced soon: a crash of the machine may lose the latest updates
};

constexpr AckLevel ack_level(Durability durability) {
  return durability == Durability::kMemory ? AckLevel::kMemory : AckLevel::kLocal;
}

struct SceneSpec {
  std::map<std::string, std::string> labels;
  Winding winding = Winding::kCounterClockwise;
  HistoryOptions history = {};
  uint64_t pinned_bytes = 0;  // budget of ReaderTracker; 0 = default
  OverloadPolicy overload = OverloadPolicy::kEveryBatch;
  Durability durability = Durability::kLocal;
};

// Revision that a caller asks for. Epoch 0 matches every epoch.
struct View {
  enum class Kind : uint8_t { kLatest, kAtLeast, kExactly };
  Kind kind = Kind::kLatest;
  uint64_t revision = 0;
  uint64_t epoch = 0;
};

struct InstanceChange {
  std::vector<Id> placed;
  uint64_t revision = 0;
  uint64_t epoch = 0;
};

struct SceneStatus {
  uint64_t memory_bytes = 0;   // memory of the latest revision without meshes, which scenes share
  uint64_t history_bytes = 0;  // additional memory of the history
  uint32_t recorded_ticks = 0;
  uint64_t pinned_bytes = 0;      // memory that only older revisions with readers hold
  uint64_t max_pinned_bytes = 0;  // limit of pinned_bytes
  uint32_t pending_changes = 0;
  uint64_t joined_updates = 0;   // number of batches that became visible only together with a later one
  std::string last_build_error;  // message of the last static change that failed; later successes do not clear it
};

class Scene {
 public:
  // Creates a scene without a log. `epoch` is not 0 and was never used for this name. `statics` may be shared with
  // another scene.
  Scene(std::string name, SceneSpec spec, uint64_t epoch, std::shared_ptr<const StaticSet> statics);
  // Creates a scene that continues from the state of `writer`, which equals the state in `log`.
  Scene(std::string name, SceneSpec spec, SceneWriter writer, const SceneLog& log);

  const std::string& name() const { return name_; }
  const SceneSpec& spec() const { return spec_; }

  using Deadline = std::chrono::steady_clock::time_point;

  // Applies one batch as one revision, or none if it changes nothing. Waits while readers exceed their budget: see
  // ReaderTracker. Refuses the batch, without any change, with the error of check_form(), BATCH_GAP, an item's error if
  // `all_or_nothing`, DEADLINE_EXCEEDED if it waited until `until`, NOT_FOUND once the scene is closed, or the log's
  // error.
  absl::StatusOr<UpdateAck> apply(const UpdateBatch& batch, Deadline until = ReaderTracker::kNever)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);

  using Acks = std::vector<absl::StatusOr<UpdateAck>>;

  // Applies several batches one after another like apply(), but logs them together with one sync. Returns one entry for
  // each batch. An error of the whole call is one of apply() and means that nothing has changed.
  absl::StatusOr<Acks> apply_each(absl::Span<const UpdateBatch* const> batches, Deadline until = ReaderTracker::kNever)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Applies several batches that may_join() as one revision, which their acks share. Returns one entry for each batch,
  // like apply_each(). An error of the whole call is one of apply() and means that nothing has changed.
  absl::StatusOr<Acks> apply_joined(absl::Span<const UpdateBatch* const> batches,
                                    Deadline until = ReaderTracker::kNever) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Removes and places instances as one revision. Builds the tree outside the writer's lock, one change at a time.
  // Waits for readers like apply(), without a deadline. NOT_FOUND for a mesh that was deleted: see check_meshes().
  absl::StatusOr<InstanceChange> change_instances(const StaticChange& change) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  using IsKept = std::function<bool(const StaticMesh*)>;
  // Refuses from now on to place meshes for which `is_kept` returns false. Call before other threads use the scene. A
  // mesh is in_use() from before `is_kept` is called for it until its change has ended.
  void check_meshes(IsKept is_kept) { is_kept_ = std::move(is_kept); }
  // Returns true if the scene contains instances of the mesh, or a pending change places some.
  bool in_use(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);

  SnapshotPtr latest() const LOCUS_EXCLUDES(mutex_);

  // Returns the snapshot that a view names; kAtLeast waits until `deadline`. FAILED_PRECONDITION SCENE_RESTARTED for
  // another epoch, OUT_OF_RANGE for kExactly outside the recent revisions, DEADLINE_EXCEEDED, or NOT_FOUND once the
  // scene is closed.
  absl::StatusOr<SnapshotPtr> view(const View& view, Deadline deadline) const LOCUS_EXCLUDES(mutex_);

  // Returns the snapshot like view(), with a pin: for readers that take long, and must poll SnapshotPin::status().
  absl::StatusOr<SnapshotPin> pin(const View& view, Deadline deadline) const LOCUS_EXCLUDES(mutex_);
  // Waits until all revoked pins are released or the scene is closed. DEADLINE_EXCEEDED, naming the limit, at `until`.
  absl::Status wait_for_readers(Deadline until) const LOCUS_EXCLUDES(mutex_);
  // Calls ReaderTracker::revoke_overdue(), for a writer that has waited too long.
  void revoke_overdue_readers() { pins_->revoke_overdue(); }

  // Notification that the scene reached a revision or was closed, for callers that must not block in view(). `notify`
  // is called once, from any thread, at the latest when that revision is published, and under the scene's lock: it must
  // be quick, must not take a lock that is held while a Watch is created or destroyed, and must not call the scene. It
  // is never called after the destructor, which waits for a running call. The scene outlives the Watch.
  class Watch {
   public:
    Watch(const Scene& scene, uint64_t revision, std::function<void()> notify);
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

   private:
    friend class Scene;
    const Scene& scene_;
    const std::function<void()> notify_;
    // Guarded by the scene's mutex_, like notified_; valid until notified.
    std::multimap<uint64_t, Watch*>::iterator position_;
    bool notified_ = false;
  };

  // Drops the recent revisions kept for kExactly views, except the latest. Frees memory when it is short.
  void forget_recent() LOCUS_EXCLUDES(mutex_);

  // Closes the scene after its deletion: wakes all waiters and refuses all later calls.
  void close() LOCUS_EXCLUDES(mutex_);
  // Deletes the scene from its log and closes it. After an error of the log the scene continues unchanged.
  absl::Status remove() LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Returns the state to be written as the log's next snapshot: the latest revision and the sequence number of its
  // record. Waits for a batch that is being applied; does not block the scene afterwards.
  FrozenScene freeze() LOCUS_EXCLUDES(writer_mutex_, mutex_);
  // Returns the extent of the log.
  LogPosition log_position() const { return journal_.position(); }
  // Records that a frozen state is now the log's snapshot. Takes `sequence` and `log_bytes` of FrozenScene.
  void snapshot_written(uint64_t sequence, uint64_t log_bytes) { journal_.snapshot_written(sequence, log_bytes); }
  // Returns 0 for a scene without a log.
  SceneKey log_key() const { return journal_.key(); }

  SceneStatus status() const LOCUS_EXCLUDES(mutex_);

 private:
  // Checks latest_, recent_ and watches_. O(1).
  void check_invariants() const LOCUS_REQUIRES(mutex_);
  // Makes the next revision visible, notifies waiters and watches, and enforces the budget of readers.
  void publish(const SnapshotPtr& snapshot) LOCUS_EXCLUDES(mutex_);
  // Notifies the watches of `revision` and earlier ones.
  void notify_watches(uint64_t revision) LOCUS_REQUIRES(mutex_);
  absl::Status closed_status() const;
  absl::Status check_open() const LOCUS_EXCLUDES(mutex_);
  absl::Status admit_change(const StaticChange& change) LOCUS_EXCLUDES(mutex_);
  void leave_change(const StaticChange& change, const absl::Status& result) LOCUS_EXCLUDES(mutex_);
  absl::Status check_kept(const StaticChange& change) const;
  absl::Status log_each(absl::Span<const UpdateBatch* const> batches) LOCUS_REQUIRES(writer_mutex_);
  absl::Status log_joined(absl::Span<const UpdateBatch* const> batches) LOCUS_REQUIRES(writer_mutex_);
  void count_joined(const Acks& acks) LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<InstanceChange> build_and_publish(const StaticChange& change) LOCUS_REQUIRES(change_mutex_)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);
  absl::StatusOr<SnapshotPtr> recent(uint64_t revision) const LOCUS_REQUIRES(mutex_);

  const std::string name_;
  const SceneSpec spec_;
  Mutex change_mutex_;  // one static change at a time; taken before writer_mutex_
  Mutex writer_mutex_;  // taken before mutex_
  SceneWriter writer_ LOCUS_GUARDED_BY(writer_mutex_);
  SceneJournal journal_;  // appended to under writer_mutex_
  IsKept is_kept_;        // null: every mesh is kept
  mutable Mutex mutex_;
  mutable ConditionVariable published_;
  SnapshotPtr latest_ LOCUS_GUARDED_BY(mutex_);
  std::deque<SnapshotPtr> recent_ LOCUS_GUARDED_BY(mutex_);                   // oldest first, latest_ last
  mutable std::multimap<uint64_t, Watch*> watches_ LOCUS_GUARDED_BY(mutex_);  // not yet notified, by revision
  uint32_t pending_changes_ LOCUS_GUARDED_BY(mutex_) = 0;
  std::vector<const StaticMesh*> meshes_to_place_ LOCUS_GUARDED_BY(mutex_);  // one entry for each pending placement
  std::string last_build_error_ LOCUS_GUARDED_BY(mutex_);
  uint64_t joined_updates_ LOCUS_GUARDED_BY(mutex_) = 0;
  bool closed_ LOCUS_GUARDED_BY(mutex_) = false;
  const std::shared_ptr<ReaderTracker> pins_;  // pins may outlive the scene
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SCENE_H_
