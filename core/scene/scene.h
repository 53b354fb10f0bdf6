// A named world: its current snapshot, its one writer at a time, and whoever waits for a revision.
//
// A scene with a log writes down what it is about to do before it does it, and does it only if that was written. What
// it does depends on nothing but the state before and what was written, so that doing it all again makes the same
// revisions, acks and refusals: see core/scene/recovery.h. A record may turn out to change nothing.
//
// Threads: every member may be called from any thread. apply() and change_instances() are serialised inside, and wait
// for the log; latest() and view() never wait for a writer or for the log: they take a lock only to copy a pointer, and
// the writer holds that lock only to swap it. Invariants: revisions of one epoch are published in order, each after it
// is complete; nothing published changes; nothing is published or acknowledged that is not logged.
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

// What becomes of update batches that come faster than they can be applied.
enum class OverloadPolicy : uint8_t {
  kEveryBatch,  // each is a revision of its own; who sends waits
  kLatestWins,  // batches that only move objects at one tick and wait together become one revision
};

// What has become of an update when it is acknowledged, where the scene has a log.
enum class Durability : uint8_t {
  kLocal,   // it is on this machine's disk
  kMemory,  // it will be soon: an end of the machine may take the last moments
};

constexpr AckLevel ack_level(Durability durability) {
  return durability == Durability::kMemory ? AckLevel::kMemory : AckLevel::kLocal;
}

struct SceneSpec {
  std::map<std::string, std::string> labels;
  Winding winding = Winding::kCounterClockwise;
  HistoryOptions history = {};
  uint64_t pinned_bytes = 0;  // as ReaderTracker takes it
  OverloadPolicy overload = OverloadPolicy::kEveryBatch;
  Durability durability = Durability::kLocal;
};

// Which revision a caller wants. Epoch 0 is not checked.
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
  uint64_t memory_bytes = 0;   // of the latest revision, without meshes, which scenes share
  uint64_t history_bytes = 0;  // of the past, beyond that
  uint32_t recorded_ticks = 0;
  uint64_t pinned_bytes = 0;      // that older revisions hold because they are still read ...
  uint64_t max_pinned_bytes = 0;  // ... and the most that may be
  uint32_t pending_changes = 0;
  uint64_t joined_updates = 0;   // batches that became visible only together with a later one
  std::string last_build_error;  // of the latest change that failed, whatever came after it
};

class Scene {
 public:
  // `epoch` is not 0 and never used before for this name. `statics` may be shared with another scene.
  Scene(std::string name, SceneSpec spec, uint64_t epoch, std::shared_ptr<const StaticSet> statics);
  // A scene that goes on from where `writer` is, which is what `log` has of it.
  Scene(std::string name, SceneSpec spec, SceneWriter writer, const SceneLog& log);

  const std::string& name() const { return name_; }
  const SceneSpec& spec() const { return spec_; }

  using Deadline = std::chrono::steady_clock::time_point;

  // One batch, one revision (none if it changes nothing). Waits while readers hold more than they may: see
  // ReaderTracker. Refuses by check_form(), by writer and batch numbers (BATCH_GAP), by `all_or_nothing`,
  // DEADLINE_EXCEEDED where it waited until `until`, NOT_FOUND once the scene is closed, or with the log's error; then
  // nothing has changed.
  absl::StatusOr<UpdateAck> apply(const UpdateBatch& batch, Deadline until = ReaderTracker::kNever)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);

  using Acks = std::vector<absl::StatusOr<UpdateAck>>;

  // Several batches one after another, each as apply() does, but logged at once: with one sync. An entry a batch; an
  // error of all is as of apply(), and then nothing has changed.
  absl::StatusOr<Acks> apply_each(absl::Span<const UpdateBatch* const> batches, Deadline until = ReaderTracker::kNever)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Several batches that may_join(), one after another, as one revision, which their acks share: an entry a batch, with
  // what apply() says of it. An error of all is as of apply(), and then nothing has changed.
  absl::StatusOr<Acks> apply_joined(absl::Span<const UpdateBatch* const> batches,
                                    Deadline until = ReaderTracker::kNever) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Removes and places instances as one revision; builds outside the writer's lock, one change at a time. Waits
  // for readers as apply() does, without an end. NOT_FOUND for a mesh that is not kept: see check_meshes().
  absl::StatusOr<InstanceChange> change_instances(const StaticChange& change) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  using IsKept = std::function<bool(const StaticMesh*)>;
  // Before others know the scene: from now on only meshes that `is_kept` are placed. A mesh that is asked about is
  // in_use() from before the question until it is placed or not.
  void check_meshes(IsKept is_kept) { is_kept_ = std::move(is_kept); }
  // Whether instances of the mesh are here or on their way.
  bool in_use(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);

  SnapshotPtr latest() const LOCUS_EXCLUDES(mutex_);

  // The snapshot a view names; at_least waits until `deadline`. FAILED_PRECONDITION SCENE_RESTARTED for another epoch,
  // OUT_OF_RANGE for `exactly` outside the recent revisions, DEADLINE_EXCEEDED, or NOT_FOUND once the scene is closed.
  absl::StatusOr<SnapshotPtr> view(const View& view, Deadline deadline) const LOCUS_EXCLUDES(mutex_);

  // The same for whoever reads for longer than a moment, and so must end when told to.
  absl::StatusOr<SnapshotPin> pin(const View& view, Deadline deadline) const LOCUS_EXCLUDES(mutex_);
  // Until those who were told to end have, or the scene is closed; DEADLINE_EXCEEDED, naming the limit, from `until`
  // on.
  absl::Status wait_for_readers(Deadline until) const LOCUS_EXCLUDES(mutex_);
  // For whoever has waited too long: ReaderTracker::cut_off().
  void revoke_overdue_readers() { pins_->revoke_overdue(); }

  // Tells once that the scene reached a revision or was closed: for whoever may not block in view(). `tell` is called
  // from any thread, at the latest when that revision is published, and under the scene's lock: it must be quick, take
  // no lock that is held while a Watch comes or goes, and leave the scene alone. Never after the Watch is gone, which
  // waits for a call in work. The scene outlives it.
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
    // Both guarded by the scene's mutex_; the place is of no meaning once told.
    std::multimap<uint64_t, Watch*>::iterator place_;
    bool notified_ = false;
  };

  // Keeps no revision but the latest for `exactly` views, until more come: gives memory back when it is short.
  void forget_recent() LOCUS_EXCLUDES(mutex_);

  // The scene was deleted: wakes all who wait, refuses all that comes.
  void close() LOCUS_EXCLUDES(mutex_);
  // Deletes it from its log, then closes it. After an error it goes on as if nothing had been asked.
  absl::Status remove() LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // What a snapshot of the log is made of: the latest revision, and which record it comes from. Waits for a batch at
  // work; the scene goes on at once.
  FrozenScene freeze() LOCUS_EXCLUDES(writer_mutex_, mutex_);
  // How far the log reaches; moves on with each append.
  LogPosition log_position() const { return journal_.position(); }
  // What was frozen is the log's snapshot now: `sequence` and `log_bytes` of FrozenScene.
  void snapshot_written(uint64_t sequence, uint64_t log_bytes) { journal_.snapshot_written(sequence, log_bytes); }
  // 0 for a scene without a log.
  SceneKey log_key() const { return journal_.key(); }

  SceneStatus status() const LOCUS_EXCLUDES(mutex_);

 private:
  void publish(const SnapshotPtr& snapshot) LOCUS_EXCLUDES(mutex_);
  // Those who wait for `revision` or an earlier one.
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
  IsKept is_kept_;        // where it is asked
  mutable Mutex mutex_;
  mutable ConditionVariable published_;
  SnapshotPtr latest_ LOCUS_GUARDED_BY(mutex_);
  std::deque<SnapshotPtr> recent_ LOCUS_GUARDED_BY(mutex_);                   // oldest first, latest_ last
  mutable std::multimap<uint64_t, Watch*> watches_ LOCUS_GUARDED_BY(mutex_);  // not yet told, by revision
  uint32_t pending_changes_ LOCUS_GUARDED_BY(mutex_) = 0;
  std::vector<const StaticMesh*> meshes_to_place_ LOCUS_GUARDED_BY(mutex_);  // of pending changes, once for each
  std::string last_build_error_ LOCUS_GUARDED_BY(mutex_);
  uint64_t joined_updates_ LOCUS_GUARDED_BY(mutex_) = 0;
  bool closed_ LOCUS_GUARDED_BY(mutex_) = false;
  const std::shared_ptr<ReaderTracker> pins_;  // pins may outlive the scene
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SCENE_H_
