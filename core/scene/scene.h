// Scene: a named world with its latest snapshot, its single writer, and the callers that wait for a revision.
//
// A scene with a log appends a record of each change before it applies the change, and applies nothing if the append
// fails. The result of a record depends only on the record and on the state before it, so that a replay produces the
// same revisions, acks and refusals: see core/scene/recovery.h. A record may have no effect, for example if its batch
// is refused.
//
// Threads: every member may be called from any thread. Calls of apply...() and change_instances() wait for each other
// and for the log. latest() and view() hold a lock only to copy a pointer, and the writer holds this lock only to
// publish a revision. So latest() and view() never wait for the writer or the log, unless view() is called for a future
// revision. Invariants: the revisions of a scene are published in order and without gaps; a published revision is
// complete and has the writer's epoch; ticks never decrease unless a batch restarts them; a published snapshot never
// changes; no change is published or acknowledged before it is logged.
#ifndef LOCUS_CORE_SCENE_SCENE_H_
#define LOCUS_CORE_SCENE_SCENE_H_

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/functional/function_ref.h"
#include "core/base/mutex.h"
#include "core/scene/log/scene_journal.h"
#include "core/scene/log/scene_state.h"
#include "core/scene/readers/reader_tracker.h"
#include "core/scene/record_applier.h"
#include "core/scene/scene_uses.h"
#include "core/scene/scene_writer.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "core/scene/snapshot/scene_summary.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// Treatment of update batches that arrive faster than they can be applied.
enum class OverloadPolicy : uint8_t {
  kEveryBatch,  // each batch is a revision of its own; senders wait for earlier batches
  kLatestWins,  // queued batches that only move objects, at the same tick, become one revision
};

// Durability of an update at the time of its acknowledgement, for a scene with a log.
enum class Durability : uint8_t {
  kLocal,       // synced to this machine's disk
  kMemory,      // synced soon after the ack: a crash of the machine may lose the latest updates
  kReplicated,  // synced by the replicated log of a cluster
};

constexpr AckLevel ack_level(Durability durability) {
  return durability == Durability::kMemory ? AckLevel::kMemory : AckLevel::kLocal;
}

// Limits of SceneSpec::cell_size.
inline constexpr double kMinCellSize = 0x1p-20, kMaxCellSize = 0x1p31;

// Settings of a scene that can be changed.
struct SceneSettings {
  std::map<std::string, std::string> labels;
  double cell_size = 0;  // see SceneSpec
};
// Values of the settings to change.
struct SettingsChange {
  std::optional<std::map<std::string, std::string>> labels;
  std::optional<double> cell_size;
};

struct SceneSpec {
  std::map<std::string, std::string> labels;
  Winding winding = Winding::kCounterClockwise;
  HistoryOptions history = {};
  uint64_t pinned_bytes = 0;  // memory budget of readers in bytes; 0: the default of ReaderTracker
  OverloadPolicy overload = OverloadPolicy::kEveryBatch;
  Durability durability = Durability::kLocal;
  std::string creator;  // caller who created the scene and whose quota it uses; empty: no creator
  // Seconds without use after which the scene is deleted; 0: never. See SceneUses.
  uint32_t idle_ttl_s = 0;
  // Seconds after which a mesh that the scene has used is deleted if no scene uses it any more; 0: never. See
  // Registry::make_collectable().
  uint32_t mesh_grace_s = 0;
  // Edge of the base cells of the objects' grid, a power of two from kMinCellSize to kMaxCellSize; 0: the grid chooses
  // the size. Affects only cost.
  double cell_size = 0;
};

// Revision that a caller requests. kLatest requests the latest revision and ignores `revision`. kAtLeast requests
// `revision` or any later revision. kExactly requests `revision`. Epoch 0 matches every epoch.
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
  uint64_t mesh_bytes = 0;     // memory of the meshes of the latest revision
  uint64_t history_bytes = 0;  // additional memory of the history
  // Upper bound of the additional memory of the revisions that are retained for kExactly views, without meshes. The
  // history may hold some of this memory as well.
  uint64_t recent_bytes = 0;
  uint32_t recorded_ticks = 0;
  PastLimit past_limit = PastLimit::kOff;  // see SceneSnapshot::past_limit
  uint64_t forgotten_ticks = 0;            // see HistoryRecorder::forgotten_ticks()
  uint64_t pinned_bytes = 0;               // memory held only by older revisions that are still being read
  uint64_t max_pinned_bytes = 0;           // limit of pinned_bytes
  uint32_t pending_changes = 0;
  uint64_t joined_updates = 0;   // number of batches that share a revision with a later batch
  std::string last_build_error;  // message of the last static change that failed; later successes do not clear it
};

class Scene {
 public:
  // Creates a scene without a log. `epoch` is not 0 and differs from the epochs of all earlier scenes of this name.
  // `statics` may be shared with another scene.
  Scene(std::string name, const SceneSpec& spec, uint64_t epoch, std::shared_ptr<const StaticSet> statics);
  // Creates a scene that continues from the state of `writer`, which is the state after the last record in `log`.
  Scene(std::string name, SceneSpec spec, SceneWriter writer, const SceneLog& log);

  const std::string& name() const { return name_; }
  // Returns the specification of which the scene was made; settings() has the labels and the cell size of now.
  const SceneSpec& spec() const { return spec_; }
  SceneSettings settings() const LOCUS_EXCLUDES(mutex_);
  // Changes settings, and logs them. Makes no revision. Waits for a batch that is being applied. If it returns an
  // error, which is that of the log or NOT_FOUND for a closed scene, nothing has changed. O(objects) if the cell size
  // changes.
  absl::StatusOr<SceneSettings> change_settings(const SettingsChange& change) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  using Deadline = std::chrono::steady_clock::time_point;

  // Applies one batch as one revision; makes no revision if the batch changes nothing. Waits while readers exceed their
  // memory budget: see ReaderTracker. After an error, nothing has changed. The errors are: the error of check_form();
  // FAILED_PRECONDITION BATCH_GAP if an earlier batch of the writer is missing; an error that names the first refused
  // item if `all_or_nothing` is set; RESOURCE_EXHAUSTED for too many objects; DEADLINE_EXCEEDED if readers still exceed
  // their budget at `until`; NOT_FOUND if the scene is closed; or the log's error.
  absl::StatusOr<UpdateAck> apply(const UpdateBatch& batch, Deadline until = ReaderTracker::kNever)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);

  using Acks = std::vector<absl::StatusOr<UpdateAck>>;

  // Applies several batches like successive calls of apply(), but logs them with a single sync. Returns one ack or
  // error for each batch. If apply_each() itself returns an error, which is one of the errors of apply(), no batch was
  // applied.
  absl::StatusOr<Acks> apply_each(absl::Span<const UpdateBatch* const> batches, Deadline until = ReaderTracker::kNever)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Applies several batches together, as one revision. Precondition: the batches satisfy may_join(). Returns one ack or
  // error for each batch. If apply_joined() itself returns an error, which is one of the errors of apply(), no batch
  // was applied.
  absl::StatusOr<Acks> apply_joined(absl::Span<const UpdateBatch* const> batches,
                                    Deadline until = ReaderTracker::kNever) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Ends the lease of a writer: removes the objects that belong to it, as one revision, which is logged like a batch.
  // Does nothing if the writer has no lease, or if `is_due` returns false. `is_due` is called when no batch is being
  // applied, right before the lease ends, so that a batch of the writer that arrived meanwhile keeps the lease; it must
  // be quick and must not call the scene. Returns the number of removed objects if the lease ended, else nullopt; the
  // errors are those of apply().
  absl::StatusOr<std::optional<uint64_t>> end_lease(uint64_t writer, absl::FunctionRef<bool()> is_due,
                                                    Deadline until = ReaderTracker::kNever)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);
  // Returns the leases of writers after the last applied batch, ascending by writer. O(1); does not wait for a batch
  // that is being applied. A batch that begins or changes a lease is in the list before it is acknowledged.
  using LeaseList = std::shared_ptr<const std::vector<Lease>>;
  LeaseList leases() const LOCUS_EXCLUDES(mutex_);

  // Removes instances and places new instances, as one revision. Changes of one scene run one at a time. Update batches
  // are not blocked while a change builds the new tree of instances. Waits like apply() while readers exceed their
  // budget, but without a deadline. Returns NOT_FOUND if a placed mesh was deleted: see check_meshes().
  absl::StatusOr<InstanceChange> change_instances(const StaticChange& change) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Applies one record that another server, which leads the scene, has logged, and publishes the revision that it
  // makes: the same as the leader's, with equal answers. Precondition: the scene has no log. Waits like apply() while
  // readers exceed their budget. Returns the latest revision after the record. Errors, after which the state is that
  // before the record: DATA_LOSS if the record is damaged or does not fit the state; FAILED_PRECONDITION if it belongs
  // to another epoch; NOT_FOUND, or the reason of close(), if the scene is closed; DEADLINE_EXCEEDED.
  absl::StatusOr<SnapshotPtr> follow(const LogEntry& record, const MeshOfRecord& find_mesh,
                                     Deadline until = ReaderTracker::kNever) LOCUS_EXCLUDES(writer_mutex_, mutex_);
  // Makes a scene that follows the leader of its log: from now on its changes are appended to `log`, whose last record
  // is the last one that was passed to follow(). Precondition: the scene has no log.
  void begin_leading(const SceneLog& log) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Returns `count` ids for instances that will be placed. No object and no instance of the latest revision has these
  // ids, and change_instances() chooses none of them for other instances. Chosen ids count up from kFirstChosenId, so
  // that an id is never chosen twice by one Scene. After a restart they continue above the ids of all instances, and
  // above kFirstChosenId plus the number of the revision, so that ids that clients may still remember are not reused
  // unless a scene has chosen more ids than it has made revisions.
  std::vector<Id> choose_ids(size_t count) LOCUS_EXCLUDES(mutex_);

  using IsKept = std::function<bool(const StaticMesh*)>;
  // Sets the check that a mesh is still registered: from now on change_instances() refuses to place a mesh for which
  // `is_kept` returns false. Call before other threads use the scene. For a mesh that a change places, in_use() returns
  // true before `is_kept` is called and until the change has ended, so that the mesh cannot be deleted between the
  // check and the placement.
  void check_meshes(IsKept is_kept) { is_kept_ = std::move(is_kept); }

  using ObjectCount = std::shared_ptr<std::atomic<uint64_t>>;
  // Adds the number of the scene's objects to `count`, and updates `count` whenever this number changes. close()
  // subtracts the number again. Call before other threads use the scene.
  void count_objects_in(ObjectCount count) LOCUS_EXCLUDES(mutex_);
  // Returns the value of the count that was passed to count_objects_in(); 0 if count_objects_in() was not called.
  uint64_t counted_objects() const { return object_count_ == nullptr ? 0 : object_count_->load(); }

  // Meshes of a change that waits to be passed to change_instances(). As long as the object exists, they count as
  // meshes of a pending change, so that nobody deletes them. Keeps the scene and the meshes alive.
  class ExpectedMeshes {
   public:
    ExpectedMeshes(std::shared_ptr<Scene> scene, const StaticChange& change);
    ~ExpectedMeshes();
    ExpectedMeshes(const ExpectedMeshes&) = delete;
    ExpectedMeshes& operator=(const ExpectedMeshes&) = delete;

   private:
    const std::shared_ptr<Scene> scene_;
    std::vector<std::shared_ptr<const StaticMesh>> meshes_;
  };

  // Returns true if the scene contains instances of the mesh, or if a pending change places instances of the mesh. A
  // pending change runs, or has ExpectedMeshes.
  bool in_use(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);

  // Adds to `meshes` every mesh that the latest revision, the history or a pending change uses. O(ticks of the
  // history).
  void add_used_meshes(absl::flat_hash_set<const StaticMesh*>& meshes) const LOCUS_EXCLUDES(mutex_);

  // Returns the record of the calls that use the scene.
  SceneUses& uses() { return uses_; }

  SnapshotPtr latest() const LOCUS_EXCLUDES(mutex_);

  // Returns the snapshot of the revision that `view` requests. kAtLeast waits for the revision until `deadline`, then
  // returns DEADLINE_EXCEEDED. Returns FAILED_PRECONDITION SCENE_RESTARTED if the scene has another epoch, OUT_OF_RANGE
  // if kExactly requests a revision that is not among the recent revisions, and NOT_FOUND if the scene is closed.
  absl::StatusOr<SnapshotPtr> view(const View& view, Deadline deadline) const LOCUS_EXCLUDES(mutex_);

  // Returns a pin of the snapshot that view() returns. Used by readers that hold the snapshot for a long time. These
  // readers must poll SnapshotPin::status().
  absl::StatusOr<SnapshotPin> pin(const View& view, Deadline deadline) const LOCUS_EXCLUDES(mutex_);
  // Waits until all revoked pins are released or the scene is closed. Returns DEADLINE_EXCEEDED, naming the limit
  // pinned_bytes, if a revoked pin is still not released at `until`.
  absl::Status wait_for_readers(Deadline until) const LOCUS_EXCLUDES(mutex_);
  // Calls the on_revoke() callbacks of revoked pins that are not released. Used if a writer has waited too long for
  // readers.
  void revoke_overdue_readers() { pins_->revoke_overdue(); }

  // Registration for one notification that the scene has reached a revision or was closed, for callers that must not
  // block in view(). `notify` is called at most once: by the constructor if the scene has already reached the revision
  // or is closed, otherwise by the thread that publishes the revision or closes the scene. The scene's lock is held
  // during the call: `notify` must be quick, must not call the scene, and must not take a lock that is held while a
  // Watch is created or destroyed. The destructor waits for a running call of `notify`. After the destructor has
  // returned, `notify` is not called. The scene outlives the Watch.
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
    // Entry of this Watch in the scene's watches_, valid while notified_ is false. The scene's mutex_ guards both
    // members.
    std::multimap<uint64_t, Watch*>::iterator position_;
    bool notified_ = false;
  };

  // Drops the oldest ticks of the history until the rest takes at most `bytes`. If a tick is dropped, this call also
  // drops the revisions that are retained for kExactly views, except the latest revision. The number of the latest
  // revision does not change. Waits for a batch that is being applied. Returns the number of bytes by which the history
  // became smaller. Called when memory is short.
  uint64_t trim_history(uint64_t bytes) LOCUS_EXCLUDES(writer_mutex_, mutex_);
  // Revokes the pins of the oldest revisions until the other pinned revisions hold at most `bytes`, and cancels the
  // readers of the revoked pins. Called when memory is short. Returns the bytes that become free once these readers
  // have ended.
  uint64_t revoke_readers(uint64_t bytes) LOCUS_EXCLUDES(mutex_);
  // Drops the revisions that are retained for kExactly views, except the latest one. Called when memory is short.
  void forget_recent() LOCUS_EXCLUDES(mutex_);
  // Drops the retained revisions and the ticks of the history that contain instances of `mesh`, and everything before
  // them. Called when the mesh was deleted, so that its memory becomes free. Drops nothing if the latest revision
  // contains an instance. Waits for a batch that is being applied.
  void forget_mesh(const StaticMesh* mesh) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Closes the scene: wakes all waiters. Later calls of view() and of the members that change the scene return `why`
  // or, if that is OK because the scene was deleted, NOT_FOUND. The first close() counts.
  void close(const absl::Status& why = absl::OkStatus()) LOCUS_EXCLUDES(mutex_);
  // Waits until no change is being applied. After close(), no change begins any more, so nothing is appended later.
  void await_changes() LOCUS_EXCLUDES(writer_mutex_) { const MutexLock lock(writer_mutex_); }
  // Deletes the scene from its log and closes it. If the log fails, returns the log's error, and the scene stays open.
  absl::Status remove() LOCUS_EXCLUDES(writer_mutex_, mutex_);
  // Does the same as remove() if `condition` returns true, and nothing otherwise. `condition` is called while no change
  // of the scene is being applied. Returns whether the scene was removed.
  absl::StatusOr<bool> remove_if(absl::FunctionRef<bool()> condition) LOCUS_EXCLUDES(writer_mutex_, mutex_);

  // Returns the state to be written as the log's next snapshot: the latest revision and the sequence number of the last
  // record. Waits for a batch that is being applied. The returned state does not block later batches.
  FrozenScene freeze() LOCUS_EXCLUDES(writer_mutex_, mutex_);
  // Returns the sequence numbers and the size of the scene's log.
  LogPosition log_position() const { return journal_.position(); }
  // Records that a state from freeze() is now the log's snapshot. The arguments are FrozenScene::sequence and
  // FrozenScene::log_bytes of that state.
  void snapshot_written(uint64_t sequence, uint64_t log_bytes) { journal_.snapshot_written(sequence, log_bytes); }
  // Returns the scene's key in the log; 0 for a scene without a log.
  SceneKey log_key() const { return journal_.key(); }

  SceneStatus status() const LOCUS_EXCLUDES(mutex_);

  // Returns a summary of the latest revision, or of a revision that was published during the call. Computes a summary
  // at most once for each snapshot, at the cost of summarize(): concurrent callers wait for the first caller and share
  // its result.
  SceneSummary summary() const LOCUS_EXCLUDES(summarizing_mutex_, mutex_);
  // Returns the summary of the latest revision if summary() has computed it already, else nullopt. O(1).
  std::optional<SceneSummary> known_summary() const LOCUS_EXCLUDES(mutex_);

 private:
  // Checks that latest_, recent_ and watches_ are consistent. O(1).
  void check_invariants() const LOCUS_REQUIRES(mutex_);
  // Makes `snapshot` the latest revision: wakes the threads that wait in view(), notifies the Watches that wait for
  // this revision, and then enforces the readers' memory budget.
  void publish(const SnapshotPtr& snapshot) LOCUS_EXCLUDES(mutex_);
  // Notifies and removes the Watches that wait for `revision` or for an earlier revision.
  void notify_watches(uint64_t revision) LOCUS_REQUIRES(mutex_);
  absl::Status closed_status() const LOCUS_REQUIRES(mutex_);
  absl::Status check_open() const LOCUS_EXCLUDES(mutex_);
  absl::Status admit_change(const StaticChange& change) LOCUS_EXCLUDES(mutex_);
  void leave_change(const StaticChange& change, const absl::Status& result) LOCUS_EXCLUDES(mutex_);
  // Count one placement more, or less, of a mesh by a pending change.
  void add_mesh_to_place(const StaticMesh* mesh) LOCUS_REQUIRES(mutex_) { ++meshes_to_place_[mesh]; }
  void remove_mesh_to_place(const StaticMesh* mesh) LOCUS_REQUIRES(mutex_);
  absl::Status check_kept(const StaticChange& change) const;
  // Returns the ack or the error of `batch`, for which SceneWriter::admit() has returned `admission`. If the batch is
  // new, applies the batch and publishes the new revision.
  absl::StatusOr<UpdateAck> answer(const UpdateBatch& batch, absl::StatusOr<SceneWriter::Admission> admission)
      LOCUS_REQUIRES(writer_mutex_);
  // Makes the list of leases() current after a batch was applied.
  void publish_leases() LOCUS_REQUIRES(writer_mutex_) LOCUS_EXCLUDES(mutex_);
  void count_joined(const Acks& acks) LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<InstanceChange> build_and_publish(const StaticChange& change) LOCUS_REQUIRES(change_mutex_)
      LOCUS_EXCLUDES(writer_mutex_, mutex_);
  // Logs `change` and publishes its result `changed`, unless update batches have meanwhile put instances into groups
  // that the change removes, or taken them out. Then the change must be built again: this function builds it again if
  // `again` is kBuildHere, and returns nullopt if it is kReturn. `statics` are the instances from which `changed` was
  // made.
  enum class WhenRegrouped : uint8_t { kReturn, kBuildHere };
  absl::StatusOr<std::optional<InstanceChange>> publish_change(const StaticChange& change, const StaticSet& statics,
                                                               StaticSet::Changed& changed, WhenRegrouped again)
      LOCUS_REQUIRES(change_mutex_) LOCUS_EXCLUDES(writer_mutex_, mutex_);
  Id next_chosen_id() LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<SnapshotPtr> recent(uint64_t revision) const LOCUS_REQUIRES(mutex_);

  const std::string name_;
  const SceneSpec spec_;
  Mutex change_mutex_;  // held during a static change; locked before writer_mutex_
  Mutex writer_mutex_;  // locked before mutex_
  SceneWriter writer_ LOCUS_GUARDED_BY(writer_mutex_);
  SceneJournal journal_;      // records are appended only under writer_mutex_
  IsKept is_kept_;            // null: every mesh may be placed
  ObjectCount object_count_;  // may be null
  SceneUses uses_;
  mutable Mutex summarizing_mutex_;  // held while summary() computes; locked before mutex_
  mutable Mutex mutex_;
  mutable ConditionVariable published_;
  mutable std::optional<SceneSummary> summary_ LOCUS_GUARDED_BY(mutex_);  // result of the last computation in summary()
  mutable std::weak_ptr<const SceneSnapshot> summarized_ LOCUS_GUARDED_BY(mutex_);  // snapshot that summary_ describes
  SnapshotPtr latest_ LOCUS_GUARDED_BY(mutex_);
  std::deque<SnapshotPtr> recent_ LOCUS_GUARDED_BY(mutex_);  // retained snapshots, oldest first; back() is latest_
  // Watches that are not notified yet. The key is the awaited revision.
  mutable std::multimap<uint64_t, Watch*> watches_ LOCUS_GUARDED_BY(mutex_);
  uint32_t pending_changes_ LOCUS_GUARDED_BY(mutex_) = 0;
  // Meshes of pending changes and of ExpectedMeshes, with the number of their placements, which is not 0.
  absl::flat_hash_map<const StaticMesh*, uint64_t> meshes_to_place_ LOCUS_GUARDED_BY(mutex_);
  std::string last_build_error_ LOCUS_GUARDED_BY(mutex_);
  SceneSettings settings_ LOCUS_GUARDED_BY(mutex_);  // changed only under writer_mutex_
  uint64_t joined_updates_ LOCUS_GUARDED_BY(mutex_) = 0;
  LeaseList leases_ LOCUS_GUARDED_BY(mutex_);                   // never null
  uint64_t lease_changes_ LOCUS_GUARDED_BY(writer_mutex_) = 0;  // SceneWriter::lease_changes() of leases_
  Id next_chosen_id_ LOCUS_GUARDED_BY(mutex_);
  bool closed_ LOCUS_GUARDED_BY(mutex_) = false;
  absl::Status close_reason_ LOCUS_GUARDED_BY(mutex_);
  const std::shared_ptr<ReaderTracker> pins_;  // shared, because pins may outlive the scene
};

inline void Scene::remove_mesh_to_place(const StaticMesh* mesh) {
  const auto found = meshes_to_place_.find(mesh);
  LOCUS_DCHECK(found != meshes_to_place_.end() && found->second > 0);
  if (--found->second == 0) meshes_to_place_.erase(found);
}

inline Scene::ExpectedMeshes::ExpectedMeshes(std::shared_ptr<Scene> scene, const StaticChange& change)
    : scene_(std::move(scene)) {
  for (const PlacementColumns& place : change.place) meshes_.push_back(place.mesh);
  const MutexLock lock(scene_->mutex_);
  for (const auto& mesh : meshes_) scene_->add_mesh_to_place(mesh.get());
}

inline Scene::ExpectedMeshes::~ExpectedMeshes() {
  const MutexLock lock(scene_->mutex_);
  for (const auto& mesh : meshes_) scene_->remove_mesh_to_place(mesh.get());
}

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SCENE_H_
