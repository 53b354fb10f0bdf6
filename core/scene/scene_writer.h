// Applies update batches to a scene's working state and freezes a snapshot for each revision. Knows no locks and no
// readers: Scene gives it exclusive use.
#ifndef LOCUS_CORE_SCENE_SCENE_WRITER_H_
#define LOCUS_CORE_SCENE_SCENE_WRITER_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
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

  // A writer that goes on from `state`: DATA_LOSS where an id occurs twice in it.
  static absl::StatusOr<SceneWriter> restore(SceneState state, Winding winding, const HistoryOptions& history);

  struct Applied {
    UpdateAck ack;
    SnapshotPtr snapshot;  // null when nothing changed
  };
  // `batch` has passed check_form(). Item errors are in the ack; with all_or_nothing any of them refuses the batch. So
  // does one object too many, with RESOURCE_EXHAUSTED.
  absl::StatusOr<Applied> apply(const UpdateBatch& batch);

  struct Joined {
    std::vector<absl::StatusOr<UpdateAck>> acks;  // one a batch
    SnapshotPtr snapshot;                         // null when nothing changed
  };
  // Applies batches that may_join() and have passed check_form(), one after another, as one revision.
  Joined apply_joined(absl::Span<const UpdateBatch* const> batches);

  // The next revision with other statics.
  SnapshotPtr replace_statics(std::shared_ptr<const StaticSet> statics);

  // From here on nobody asks for snapshots, and none are made, until end_replay(): apply() and the others tell of none,
  // and published() says nothing.
  void begin_replay() { replaying_ = true; }
  void end_replay();
  // From now on revisions are of another epoch. They go on being counted.
  void restart(uint64_t epoch);

  // The revision reached so far.
  const SnapshotPtr& published() const { return published_; }
  uint64_t epoch() const { return epoch_; }
  const WriterTable& writers() const { return writers_; }
  // Whether restarting ticks forgets anything, and so makes a revision.
  bool has_past() const { return recorder_.has_past(); }

  bool is_object(Id id) const { return objects_.handle(id) != ObjectStore::kNoHandle; }
  const std::shared_ptr<const StaticSet>& statics() const { return statics_; }

 private:
  SnapshotPtr freeze();
  SnapshotPtr next_revision();
  UpdateAck ack_now() const;
  // What the batch came to, into the ack; refuses it if it is all_or_nothing and an item is wrong.
  template <class Application>
  static absl::Status fill_ack(const UpdateBatch& batch, Application& application, Applied& result);
  absl::StatusOr<Applied> apply_moves(const UpdateBatch& batch);
  // What the moves at hand come to, at the tick of `batch`; null when that is nothing.
  SnapshotPtr publish_moves(const UpdateBatch& batch);
  // Whether snapshots can wait: what was published is what the past is made of.
  bool defer_snapshots() const { return replaying_ && !recorder_.on(); }
  // Makes the moves at hand; whether they change anything.
  bool apply_staged_moves();
  // Makes those that were put off.
  void flush_coalesced_moves();
  // Where an applied batch became visible, into its ack, which is remembered.
  void record_ack(const UpdateBatch& batch, UpdateAck& ack);
  // Of a batch that was applied before.
  UpdateAck old_ack(const UpdateBatch& batch) const;
  absl::StatusOr<Applied> apply_changes(const UpdateBatch& batch);
  // Whether the batch drops anything of the past.
  bool forgets(const UpdateBatch& batch) const { return batch.restart_ticks && has_past(); }
  uint64_t tick_of(const UpdateBatch& batch) const;
  // What the batch means to the past, before anything of it is applied: the end of the tick before, or of all.
  void start_tick(const UpdateBatch& batch);
  // Applies the tick; the next revision if that changes anything or `changes` says so, and the ack's last part.
  void publish_changes(const UpdateBatch& batch, bool changes, Applied& result);

  uint64_t epoch_;
  size_t max_objects_;
  uint64_t revision_ = 0;
  uint64_t tick_ = 0;
  Winding winding_;
  std::shared_ptr<const StaticSet> statics_;
  ObjectStore objects_;
  MoveApplier moves_;
  CoalescedMoves coalesced_moves_;  // put off; only where defer_snapshots()
  WriterTable writers_;
  HistoryRecorder recorder_;
  uint64_t replaced_bytes_ = 0;  // of objects and statics so far
  bool replaying_ = false;
  SnapshotPtr published_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SCENE_WRITER_H_
