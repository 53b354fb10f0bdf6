// Displacements of objects since the last recorded tick. Searches at a time between two ticks are widened by these
// displacements. Used by the writer of a scene with history; one thread at a time.
//
// Most objects move little, and one bound covers all of them. Objects that moved farther than the width of a cell are
// fast: they are listed individually, so that a single fast object does not widen every search. If more than kMaxFast
// objects are listed, the length above which an object is fast is doubled until at most kMaxFast / 2 objects are
// listed. Invariants: the list is ascending by handle, holds at most kMaxFast objects, and holds exactly the objects of
// Kind::kListed.
#ifndef LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_
#define LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_

#include <memory>
#include <vector>

#include "core/index/hash_grid/grid_snapshot.h"

namespace locus {

// Object that moved far in a tick. `extent` is an upper bound, under any rotation, of the distance from the object's
// position to any of its points. `centers` are the bounds of the object's position at the start of the tick and of its
// positions since it became fast.
struct FastMover {
  uint32_t handle = 0;
  float extent = 0;
  double length = 0;  // largest distance from the position at the start of the tick
  Aabbd centers;
};

// Displacements of all objects between two recorded states.
struct Displacement {
  double bound = 0;  // upper bound of the displacement of every object that is not in `fast`
  std::shared_ptr<const std::vector<FastMover>> fast;  // ascending by handle; null if no object is fast
};

class TickMoves {
 public:
  static constexpr size_t kMaxFast = 64;

  // Begins a tick and drops the recorded moves. Objects that move farther than `fast_length` in the tick are fast.
  void start_tick(double fast_length);
  // Records a new object. The object did not exist when the tick began, so its moves do not count in this tick.
  void born(uint32_t handle);
  // Records a move to `to`. `before` is the object before the move.
  void moved(const GridRef& before, Vec3d to);
  // Returns the displacement since start_tick().
  const Displacement& displacement();

 private:
  // Role of an object in this tick. kOrdinary: Displacement::bound covers its moves. kListed: the object is in fast_,
  // and every further move extends its FastMover::centers, however short the move is. kNewborn: the object was inserted
  // in this tick, so its moves do not count.
  enum class Kind : uint8_t { kOrdinary, kListed, kNewborn };
  // Entry of an object, written when the object is inserted or first moves in the tick. Its position and extent are
  // those of the object when the tick began; they have no meaning if the object was inserted in the tick (kNewborn).
  struct Start {
    Vec3d position;
    uint64_t tick = 0;  // value of tick_ when this entry was written; if tick_ differs, the entry is stale
    float extent = 0;
    Kind kind = Kind::kOrdinary;
  };
  // Checks the invariants of the class comment. O(kMaxFast).
  void check_invariants() const;
  Start& start_of(uint32_t handle);
  // Adds an object to fast_, or extends FastMover::centers of an object that is already in fast_.
  void add_fast(uint32_t handle, Start& start, Vec3d to, double length);
  // Raises fast_length_ until at most kMaxFast / 2 objects are listed.
  void list_fewer();

  std::vector<Start> starts_;  // indexed by handle
  uint64_t tick_ = 1;          // number of start_tick() calls, plus 1
  double fast_length_ = 0;
  std::vector<FastMover> fast_;
  bool fast_changed_ = false;
  Displacement displacement_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_
