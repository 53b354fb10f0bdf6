// Writer of a scene: applies update batches to the working state and freezes a snapshot for each revision. One thread
// at a time: Scene serialises the calls. Invariants: each revision is one more than the previous one; the tick never
// decreases unless a batch restarts ticks; published() is the snapshot of the current revision unless snapshots are
// deferred.
#ifndef LOCUS_CORE_SCENE_SCENE_WRITER_H_
#define LOCUS_CORE_SCENE_SCENE_WRITER_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/scene/log/scene_state.h"
#include "core/scene/objects/object_store.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "core/scene/updates/batch_applier.h"
#include "core/scene/updates/coalesced_moves.h"
#include "core/scene/updates/move_applier.h"
#include "core/scene/updates/update_batch.h"
#include "core/scene/updates/writer_table.h"

namespace locus {

class SceneWriter {
 public:
  SceneWriter(uint64_t epoch, Winding winding, std::shared_ptr<const StaticSet> statics,
              size_t max_objects = limits::kMaxObjects, const HistoryOptions& history = {});

  // Returns a writer that continues from `state`. DATA_LOSS if an id occurs twice in it.
  static absl::StatusOr<SceneWriter> restore(SceneState state, Winding winding, const HistoryOptions& history);

  struct Applied {
    UpdateAck ack;
    SnapshotPtr snapshot;  // null when nothing changed
  };
  // Applies one batch. Precondition: it has passed check_form(). Item errors are listed in the ack; with all_or_nothing
  // any of them refuses the batch. Too many objects refuse it, too, with RESOURCE_EXHAUSTED.
  absl::StatusOr<Applied> apply(const UpdateBatch& batch);

  struct Joined {
    std::vector<absl::StatusOr<UpdateAck>> acks;  // one entry for each batch
    SnapshotPtr snapshot;                         // null when nothing changed
  };
  // Applies batches that may_join() and have passed check_form(), one after another, as one revision.
  Joined apply_joined(absl::Span<const UpdateBatch* const> batches);

  // Makes the next revision, with other instances, and returns its snapshot.
  SnapshotPtr replace_statics(std::shared_ptr<const StaticSet> statics);

  // Begins replay: until end_replay() no snapshots are built if the scene has no history; apply() and the others may
  // return null, and published() must not be called.
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
  // Returns true if restarting ticks would drop history, and so makes a revision.
  bool has_past() const { return recorder_.has_past(); }

  bool is_object(Id id) const { return objects_.handle(id) != ObjectStore::kNoHandle; }
  const std::shared_ptr<const StaticSet>& statics() const { return statics_; }

 private:
  // Checks the invariants of the class comment. O(1).
  void check_invariants() const;
  SnapshotPtr freeze();
  SnapshotPtr next_revision();
  UpdateAck ack_now() const;
  // Copies the counts and errors of the applied batch into the ack. Refuses the batch if it is all_or_nothing and an
  // item is wrong.
  template <class Applier>
  static absl::Status fill_ack(const UpdateBatch& batch, Applier& applier, Applied& result);
  // Applies a batch that MoveApplier serves.
  absl::StatusOr<Applied> apply_moves(const UpdateBatch& batch);
  // Applies the staged moves at the tick of `batch`; returns the new snapshot, null if nothing changed.
  SnapshotPtr publish_moves(const UpdateBatch& batch);
  // Returns true if snapshots are not built now. With history each is needed, because records are made of snapshots.
  bool defer_snapshots() const { return replaying_ && !recorder_.on(); }
  // Applies the staged moves, or coalesces them during replay; returns true if they change anything.
  bool apply_staged_moves();
  // Applies the coalesced moves.
  void flush_coalesced_moves();
  // Stamps the current epoch, revision and tick on the ack of an applied batch and stores it in the writer table.
  void record_ack(const UpdateBatch& batch, UpdateAck& ack);
  // Returns the stored ack of a duplicate batch.
  UpdateAck old_ack(const UpdateBatch& batch) const;
  // Applies a batch of any kind.
  absl::StatusOr<Applied> apply_changes(const UpdateBatch& batch);
  // Returns true if the batch drops history.
  bool drops_history(const UpdateBatch& batch) const { return batch.restart_ticks && has_past(); }
  // Returns the tick after the batch.
  uint64_t tick_of(const UpdateBatch& batch) const;
  // Records the end of the previous tick in the history, or drops the history if the batch restarts ticks. Call before
  // the batch is applied.
  void start_tick(const UpdateBatch& batch);
  // Sets the tick, makes the next revision if the tick or, by `changes`, an object changed, and completes the ack.
  void publish_changes(const UpdateBatch& batch, bool changes, Applied& result);

  uint64_t epoch_;
  size_t max_objects_;
  uint64_t revision_ = 0;
  uint64_t tick_ = 0;
  Winding winding_;
  std::shared_ptr<const StaticSet> statics_;
  ObjectStore objects_;
  MoveApplier moves_;
  CoalescedMoves coalesced_moves_;  // not yet applied; only with defer_snapshots()
  WriterTable writers_;
  HistoryRecorder recorder_;
  uint64_t replaced_bytes_ = 0;  // memory of objects and statics replaced so far
  bool replaying_ = false;
  SnapshotPtr published_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SCENE_WRITER_H_
