// Moves of many batches that nobody has seen yet, so that the grid need hear of each object once: what makes replaying
// a log sooner done than it took to write it. One thread at a time.
#ifndef LOCUS_CORE_SCENE_UPDATES_COALESCED_MOVES_H_
#define LOCUS_CORE_SCENE_UPDATES_COALESCED_MOVES_H_

#include <vector>

#include "core/scene/objects/object_store.h"

namespace locus {

class CoalescedMoves {
 public:
  // Adds a batch's moves, of objects of `store`. Whether any of them changes anything after those before. O(moves).
  bool add(const GridMoves& batch, const ObjectStore& store);

  bool empty() const { return moves_.empty(); }
  // What all came to.
  GridMoves moves() const { return {moves_, rotations_, numbers_}; }
  // Gives the memory back, too.
  void clear() { *this = CoalescedMoves(); }

 private:
  // The object's move, or null.
  GridMove* find(uint32_t handle) {
    const uint32_t number = handle < numbers_.size() ? numbers_[handle] : 0;
    return number < moves_.size() && moves_[number].handle == handle ? &moves_[number] : nullptr;
  }
  bool differs(const GridMove& move, const Quaternion* rotation, const GridMove* before, const GridRef& stored) const;

  std::vector<GridMove> moves_;  // of distinct handles
  std::vector<Quaternion> rotations_;
  std::vector<uint32_t> numbers_;  // by handle; counts only if the move of that number is of that handle
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_COALESCED_MOVES_H_
