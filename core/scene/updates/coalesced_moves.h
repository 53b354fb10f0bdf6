// Moves of several batches, coalesced during replay: the grid is updated once for each object, so that replaying a log
// takes less time than the original updates took. One thread at a time. Invariant: each handle has at most one move.
#ifndef LOCUS_CORE_SCENE_UPDATES_COALESCED_MOVES_H_
#define LOCUS_CORE_SCENE_UPDATES_COALESCED_MOVES_H_

#include <vector>

#include "core/scene/objects/object_store.h"

namespace locus {

class CoalescedMoves {
 public:
  // Adds the moves of one batch for objects of `store`. Returns true if at least one of these moves changes the
  // position or rotation that its object has after the moves of earlier calls. O(moves).
  bool add(const GridMoves& batch, const ObjectStore& store);

  bool empty() const { return moves_.empty(); }
  // Returns the final move of each object.
  GridMoves moves() const { return {moves_, rotations_, move_of_handle_}; }
  // Removes all moves and frees their memory.
  void clear() { *this = CoalescedMoves(); }

 private:
  // Checks the invariant of the class comment for the move of `handle`. O(1).
  void check_invariants(uint32_t handle);
  // Returns the coalesced move of the object with this handle, or null.
  GridMove* find(uint32_t handle) {
    const uint32_t index = handle < move_of_handle_.size() ? move_of_handle_[handle] : 0;
    return index < moves_.size() && moves_[index].handle == handle ? &moves_[index] : nullptr;
  }
  bool differs(const GridMove& move, const Quaternion* rotation, const GridMove* before, const GridRef& stored) const;

  std::vector<GridMove> moves_;  // at most one move for each handle
  std::vector<Quaternion> rotations_;
  // For each handle, the index of its move in moves_. An entry is stale unless the move at this index has the same
  // handle.
  std::vector<uint32_t> move_of_handle_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_COALESCED_MOVES_H_
