// Writer of a scene: applies update batches to the working state and freezes a snapshot for each revision. One thread
// at a time: Scene serialises the calls. Invariants: each revision is one more than the previous one; the tick never
// decreases unless a batch restarts ticks; published() is the snapshot of the current revision unless snapshots are
// deferred.
#ifndef LOCUS_CORE_SCENE_SCENE_WRITER_H_
#define LOCUS_CORE_SCENE_SCENE_WRITER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/scene/log/scene_state.h"
#include "core/scene/objects/expiries.h"
#include "core/scene/objects/leases.h"
#include "core/scene/objects/object_store.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "core/scene/updates/batch_applier.h"
#include "core/scene/updates/coalesced_moves.h"
#include "core/scene/updates/instance_applier.h"
#include "core/scene/updates/move_applier.h"
#include "core/scene/updates/update_batch.h"
#include "core/scene/updates/writer_table.h"

namespace locus {

class SceneWriter {
 public:
  SceneWriter(uint64_t epoch, Winding winding, std::shared_ptr<const StaticSet> statics,
              size_t max_objects = limits::kMaxObjects, const HistoryOptions& history = {});

  // Returns a writer that continues from `state`. `cell_size` is an argument of fix_cell_size(). Returns DATA_LOSS if
  // an id occurs twice in `state`, or if an expiry or a lease names an object that `state` does not have.
  static absl::StatusOr<SceneWriter> restore(SceneState state, Winding winding, const HistoryOptions& history,
                                             double cell_size = 0);

  // Fixes the cell size of the objects' grid; 0 lets the grid choose it. Makes no revision, since no answer changes.
  void fix_cell_size(double cell_size) { objects_.fix_cell_size(cell_size); }

  // The ack of a batch that was applied before, or nullopt if the batch is new.
  using Admission = std::optional<UpdateAck>;
  // Returns the ack of a batch that was applied before, marked as duplicate, or nullopt if the batch is new. If the
  // writer table has dropped the ack, the returned ack has the current revision instead. Returns FAILED_PRECONDITION
  // BATCH_GAP if an earlier batch of the writer is missing. Precondition: the batch has passed check_form().
  absl::StatusOr<Admission> admit(const UpdateBatch& batch) const;

  struct Applied {
    UpdateAck ack;
    SnapshotPtr snapshot;  // null if nothing changed, or if a replay defers snapshots
  };
  // Applies one batch. Precondition: admit() has returned nullopt for the batch. The ack lists refused items; with
  // all_or_nothing, one refused item refuses the whole batch. Returns RESOURCE_EXHAUSTED if the scene would have too
  // many objects or leases. A batch with end_lease for a writer without a lease changes nothing.
  absl::StatusOr<Applied> apply_new(const UpdateBatch& batch);
  // Calls admit(), and then apply_new() if the batch is new. Returns the errors of both functions.
  absl::StatusOr<Applied> apply(const UpdateBatch& batch);

  struct Joined {
    std::vector<absl::StatusOr<UpdateAck>> acks;  // one entry for each batch
    SnapshotPtr snapshot;                         // null if nothing changed, or if a replay defers snapshots
  };
  // Applies the batches in order, as one revision. Calls log() once, before the first new batch is applied, or never if
  // no batch is new. If log() returns an error, applies nothing and returns this error. Preconditions: each batch has
  // passed check_form(), and may_join() is true for every pair of the first batch and another batch.
  absl::StatusOr<Joined> apply_joined(absl::Span<const UpdateBatch* const> batches,
                                      absl::FunctionRef<absl::Status()> log);

  // Makes the next revision, which has the instances `statics`, and returns its snapshot.
  SnapshotPtr replace_statics(std::shared_ptr<const StaticSet> statics);

  // Drops the oldest records of the history until the rest takes at most `bytes`. Returns a snapshot of the current
  // revision with the shorter history, or null if no record was dropped.
  SnapshotPtr trim_history(uint64_t bytes);

  // Drops the records of the history up to the last one that has instances of `mesh`, which was deleted. Returns a
  // snapshot as trim_history() does.
  SnapshotPtr forget_mesh(const StaticMesh* mesh);

  // Begins replay, during which published() must not be called. If the scene has no history, no snapshots are built
  // during the replay, so apply(), apply_joined() and replace_statics() return null snapshots.
  void begin_replay() {
    LOCUS_DCHECK(!replaying_);
    replaying_ = true;
  }
  // Ends replay: applies the coalesced moves and builds the snapshot of the current revision.
  void end_replay();
  // Starts another epoch. Revision numbers continue.
  void restart(uint64_t epoch);

  // Returns the snapshot of the current revision. Precondition: no replay is running.
  const SnapshotPtr& published() const {
    LOCUS_DCHECK(!replaying_);
    return published_;
  }
  uint64_t epoch() const { return epoch_; }
  const WriterTable& writers() const { return writers_; }
  // Returns true if a batch with restart_ticks would end the scene's history: see HistoryRecorder::has_past(). Such a
  // batch makes a revision even if it changes nothing else.
  bool has_past() const { return recorder_.has_past(); }

  // Leases of writers, ascending by writer, and the number of changes of this list so far.
  std::vector<Lease> leases() const { return leases_.list(); }
  uint64_t lease_changes() const { return leases_.changes(); }
  bool has_lease(uint64_t writer) const { return leases_.has(writer); }
  // Returns the leases and their objects at the current revision.
  LeaseTable lease_table() { return leases_.table(); }

  bool is_object(Id id) const { return objects_.handle(id) != ObjectStore::kNoHandle; }
  const std::shared_ptr<const StaticSet>& statics() const { return statics_; }

 private:
  // Checks the invariants of the class comment. O(1).
  void check_invariants() const;
  SnapshotPtr freeze();
  SnapshotPtr next_revision();
  // Sets the epoch, revision and tick of `ack` to the current values.
  void set_revision(UpdateAck& ack) const;
  // Moves the counts and errors of `applier`, and then those of `instances`, into the ack of `result`. Returns an error
  // if the batch is all_or_nothing and an item was refused.
  template <class Applier>
  static absl::Status fill_ack(const UpdateBatch& batch, Applier& applier, InstanceApplier& instances, Applied& result);
  // Replaces the changed instances. Returns false if there are none.
  bool apply_instances(InstanceApplier& instances);
  // Applies a batch for which MoveApplier::serves() returns true.
  absl::StatusOr<Applied> apply_moves(const UpdateBatch& batch);
  // Applies the moves that moves_ has read and those of `instances`, which may be null, at the tick of `batch`, after
  // start_tick(). `changed` is true if the revision has other changes. Returns the new snapshot, or null if nothing
  // changed or snapshots are deferred.
  SnapshotPtr publish_moves(const UpdateBatch& batch, InstanceApplier* instances, bool changed);
  // Returns true during a replay that builds no snapshots. A scene with history builds snapshots during replay, too,
  // because history records are made from snapshots.
  bool defer_snapshots() const { return replaying_ && !recorder_.on(); }
  TrackLifetimes track_lifetimes() const { return recorder_.on() ? TrackLifetimes::kYes : TrackLifetimes::kNo; }
  // Applies the moves in moves_ to objects_, or adds them to coalesced_moves_ if snapshots are deferred. Returns true
  // if the moves change an object.
  bool apply_staged_moves();
  // Applies coalesced_moves_ to objects_ and clears them.
  void flush_coalesced_moves();
  // Sets the epoch, revision and tick of the ack of an applied batch to the current values, and stores the ack in the
  // writer table.
  void record_ack(const UpdateBatch& batch, UpdateAck& ack);
  // Applies a batch of any kind with BatchApplier.
  absl::StatusOr<Applied> apply_changes(const UpdateBatch& batch);
  // Returns true if the batch may change expiries or leases of objects.
  bool changes_lifetimes(const UpdateBatch& batch) const;
  // Removes from `applier` the objects that expire with the batch, or whose lease the batch ends.
  void remove_ended(const UpdateBatch& batch, BatchApplier& applier) const;
  // Applies the changes of `applier` to objects_, and their effect on expiries and leases. Returns true if an object or
  // an expiry changed.
  bool apply_objects(const UpdateBatch& batch, BatchApplier& applier);
  // Removes the objects that expire at the tick of `batch`. Returns true if there are any. Call after start_tick().
  bool expire(const UpdateBatch& batch);
  // Removes the expiries and the owners of objects that were removed, and gives those of objects that began a new
  // lifetime with a teleport to their new handles. `handles` are those of `removed` before the changes.
  void follow_handles(absl::Span<const Object> removed, absl::Span<const uint32_t> handles,
                      const absl::flat_hash_map<Id, uint64_t>& inserted);
  // Returns true if the batch drops history.
  bool drops_history(const UpdateBatch& batch) const { return batch.restart_ticks && has_past(); }
  // Returns the tick that the scene will have after the batch.
  uint64_t tick_of(const UpdateBatch& batch) const;
  // Drops the history and shifts the expiries if the batch restarts ticks. Otherwise, if the batch begins another tick,
  // adds the state at the end of the current tick to the history. Call once, before the batch is applied.
  void start_tick(const UpdateBatch& batch);
  // Makes the next revision if `changes` is true or the batch begins a new tick. Then sets the epoch, revision and tick
  // of the ack in `result`.
  void publish_changes(const UpdateBatch& batch, bool changes, Applied& result);

  uint64_t epoch_;
  size_t max_objects_;
  uint64_t revision_ = 0;
  uint64_t tick_ = 0;
  Winding winding_;
  std::shared_ptr<const StaticSet> statics_;
  ObjectStore objects_;
  Expiries expiries_;
  Leases leases_;
  MoveApplier moves_;
  CoalescedMoves coalesced_moves_;  // not yet applied to objects_; empty unless defer_snapshots()
  WriterTable writers_;
  HistoryRecorder recorder_;
  uint64_t replaced_bytes_ = 0;  // bytes of objects and instances that revisions have replaced so far
  bool replaying_ = false;
  SnapshotPtr published_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SCENE_WRITER_H_
