// Reads a batch that only moves objects, the common case at every tick, and converts its columns directly into moves of
// the grid. Like BatchApplier, MoveApplier does not change the store; ObjectStore::move() applies the moves.
//
// Reuses its memory from batch to batch. One thread at a time. Invariant: each handle has at most one move.
#ifndef LOCUS_CORE_SCENE_UPDATES_MOVE_APPLIER_H_
#define LOCUS_CORE_SCENE_UPDATES_MOVE_APPLIER_H_

#include <vector>

#include "absl/types/span.h"
#include "core/base/scratch.h"
#include "core/scene/objects/object_store.h"
#include "core/scene/updates/pose_reader.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

class MoveApplier {
 public:
  // Returns true if the batch only moves objects, without new poses of parts, and does not restart ticks.
  static bool serves(const UpdateBatch& batch);

  // Reads one batch. Preconditions: the batch has passed check_form(), and serves(batch) is true. O(items).
  void run(const ObjectStore& objects, const UpdateBatch& batch) {
    begin(objects);
    add(objects, batch);
    finish(objects);
  }
  // Read several batches together: call begin(), add() for each batch in order, and finish().
  void begin(const ObjectStore& objects);
  void add(const ObjectStore& objects, const UpdateBatch& batch);
  void finish(const ObjectStore& objects);

  // Removes the moves of the last run() or finish().
  void clear() {
    clear_scratch(moves_);
    clear_scratch(rotations_);
  }

  // Returns the moves of the last run() or finish(), one for each object that moves, with the last position and the
  // last rotation that the batches set.
  GridMoves moves() const { return {moves_, rotations_, last_move_}; }
  // Returns true if any of moves() changes a position or a rotation.
  bool changes() const { return changes_; }
  // Return the numbers of applied and refused items, and the errors, of the last batch passed to run() or add().
  uint32_t applied() const { return applied_; }
  uint32_t refused() const { return refused_; }
  std::vector<ItemError>& errors() { return errors_; }

 private:
  // Checks that each handle has one move. O(moves).
  void check_invariants() const;
  void run(const ObjectStore& objects, Vec3d frame, const MoveColumns& columns, size_t list);
  // Returns the handles of `ids`, the next items of the batch, until the next call.
  absl::Span<const uint32_t> handles_of(const ObjectStore& objects, absl::Span<const Id> ids);
  struct Item {
    size_t list;
    uint32_t index;
    Id id;
  };
  void move(const PoseReader& poses, uint32_t handle, const Item& item);
  void refuse(const char* column, const Item& item, Reason reason);
  uint32_t add_move(uint32_t handle, Vec3d position);

  std::vector<GridMove> moves_;
  std::vector<Quaternion> rotations_;
  // For each handle, the index of its move in moves_. An entry is stale unless the move at this index has the same
  // handle.
  std::vector<uint32_t> last_move_;
  // Ids and handles of the first items of an earlier batch, in order; all of them are known ids. Most senders move the
  // same objects in the same order at every tick, so that comparing ids replaces looking them up. Valid while
  // ObjectStore::ended_lives() is lives_ended_.
  std::vector<Id> remembered_ids_;
  std::vector<uint32_t> remembered_handles_;
  uint64_t lives_ended_ = 0;
  size_t items_read_ = 0;          // number of items of the batch that were read
  std::vector<uint32_t> handles_;  // handles of the items being read
  bool changes_ = false;
  uint32_t applied_ = 0;
  uint32_t refused_ = 0;
  std::vector<ItemError> errors_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_MOVE_APPLIER_H_
