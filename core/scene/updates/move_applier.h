// One batch that only moves objects: the common case at every tick, read straight from its columns into moves of the
// grid. Like BatchApplier otherwise: nothing changes until the moves are handed to the store.
//
// Keeps its memory from batch to batch; one thread.
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
  static bool serves(const UpdateBatch& batch);

  // `batch` has passed check_form(), and serves() is true of it. O(items).
  void run(const ObjectStore& objects, const UpdateBatch& batch) {
    begin(objects);
    add(objects, batch);
    finish(objects);
  }
  // The same of several batches, one after another, between a begin() and a finish().
  void begin(const ObjectStore& objects);
  void add(const ObjectStore& objects, const UpdateBatch& batch);
  void finish(const ObjectStore& objects);

  // Forgets what the last run() came to.
  void clear() {
    clear_scratch(moves_);
    clear_scratch(rotations_);
  }

  // What the last run() came to. A handle occurs once: of several moves of one object the last counts.
  GridMoves moves() const { return {moves_, rotations_, last_move_}; }
  // Whether any of them changes anything.
  bool changes() const { return changes_; }
  // Of the last batch.
  uint32_t applied() const { return applied_; }
  uint32_t refused() const { return refused_; }
  std::vector<ItemError>& errors() { return errors_; }

 private:
  void run(const ObjectStore& objects, Vec3d frame, const MoveColumns& columns, size_t list);
  struct Item {
    size_t list;
    uint32_t index;
    Id id;
  };
  void move(const PoseReader& poses, uint32_t handle, const Item& item);
  void refuse(const char* column, const Item& item, Reason reason);
  GridMove& move_of(uint32_t handle);

  std::vector<GridMove> moves_;
  std::vector<Quaternion> rotations_;
  std::vector<uint32_t> last_move_;  // by handle; counts only if the move of that number is of that handle
  std::vector<uint32_t> handles_;    // of the items at work
  bool changes_ = false;
  uint32_t applied_ = 0;
  uint32_t refused_ = 0;
  std::vector<ItemError> errors_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_MOVE_APPLIER_H_
