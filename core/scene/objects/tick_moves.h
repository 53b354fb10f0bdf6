// Displacements of objects since the last recorded tick. Searches at a time between two ticks are widened by these
// displacements. Used by the writer of a scene with history; one thread at a time.
//
// Most objects move little, and one bound covers all of them. The few that moved farther than a cell are listed one by
// one, so that a single fast object does not widen every search. If more than kMaxFast objects are listed, the length
// above which an object is fast is doubled until at most half as many are. Invariants: the list is ascending by handle,
// holds at most kMaxFast objects, and holds exactly the objects of Kind::kListed.
#ifndef LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_
#define LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_

#include <memory>
#include <vector>

#include "core/index/hash_grid/grid_snapshot.h"

namespace locus {

// Object that moved far: the box of all positions of its centre, and its extent around the centre under any rotation.
struct FastMover {
  uint32_t handle = 0;
  float extent = 0;
  double length = 0;  // largest distance from the position at the start of the tick
  Aabbd centers;
};

// Displacements of all objects between two recorded states.
struct Displacement {
  double bound = 0;                                    // upper bound for every object that is not in `fast`
  std::shared_ptr<const std::vector<FastMover>> fast;  // ascending by handle; null if there are none
};

class TickMoves {
 public:
  static constexpr size_t kMaxFast = 64;

  // Begins a tick and drops the recorded moves. Objects that move farther than `fast_length` in the tick are fast.
  void start_tick(double fast_length);
  // Records a new object. It did not exist when the tick began, so that its moves do not count in this tick.
  void born(uint32_t handle);
  // Records a move to `to`. `before` is the object as it is before the move.
  void moved(const GridRef& before, Vec3d to);
  // Returns the displacement since start_tick().
  const Displacement& displacement();

 private:
  // Role of an object in this tick. kListed: the object is in fast_, and every further move extends its box, however
  // short the move is.
  enum class Kind : uint8_t { kOrdinary, kListed, kNewborn };
  // State of an object when the tick began, written when the object first moves in the tick or is inserted.
  struct Start {
    Vec3d position;
    uint64_t tick = 0;  // value of tick_ when this was written; if tick_ differs, the entry is stale
    float extent = 0;
    Kind kind = Kind::kOrdinary;
  };
  // Checks the invariants of the class comment. O(kMaxFast).
  void check_invariants() const;
  Start& start_of(uint32_t handle);
  // Adds an object to fast_, or extends the box of one that is in fast_.
  void add_fast(uint32_t handle, Start& start, Vec3d to, double length);
  // Raises fast_length_ until at most half of kMaxFast objects are listed.
  void list_fewer();

  std::vector<Start> starts_;  // by handle
  uint64_t tick_ = 1;          // number of start_tick() calls, plus 1
  double fast_length_ = 0;
  std::vector<FastMover> fast_;
  bool fast_changed_ = false;
  Displacement displacement_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_
