// How far objects moved since the last tick was recorded: what bounds a search for where they were in between. Kept by
// the writer of a scene with history; one thread at a time.
//
// Most objects move little, and one number bounds them all. The few that moved farther than a cell are listed, so that
// no single one makes all searches wide; where too many would be listed, "farther" comes to mean twice as far.
#ifndef LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_
#define LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_

#include <memory>
#include <vector>

#include "core/index/hash_grid/grid_snapshot.h"

namespace locus {

// An object that moved far: every place where its centre was, and how far it extends from there, whatever its rotation.
struct FastMover {
  uint32_t handle = 0;
  float reach = 0;
  double length = 0;  // how far it moved
  Aabbd centers;
};

// Of all objects between two moments.
struct Displacement {
  double reach = 0;                                    // no object that is not listed moved farther
  std::shared_ptr<const std::vector<FastMover>> fast;  // ascending by handle; null where there are none
};

class TickMoves {
 public:
  static constexpr size_t kMaxFast = 64;

  // A new tick begins. Objects that move farther than `fast_length` in it are fast.
  void start_tick(double fast_length);
  // `handle` is a new life: it was not there when the tick began, so that it moves in no search.
  void born(uint32_t handle);
  // The object moves to `to`. `before` is what it is until then.
  void moved(const GridRef& before, Vec3d to);
  // Of all moves since start_tick().
  const Displacement& displacement();

 private:
  // A listed object is in fast_: every further move has to widen its box, however short the move is.
  enum class Kind : uint8_t { kOrdinary, kListed, kNewborn };
  struct Start {
    Vec3d position;
    uint64_t tick = 0;  // counted by start_tick(); of another one this says nothing
    float reach = 0;
    Kind kind = Kind::kOrdinary;
  };
  Start& start_of(uint32_t handle);
  // Lists an object, or extends the box of a listed one.
  void add_fast(uint32_t handle, Start& start, Vec3d to, double length);
  void list_fewer();

  std::vector<Start> starts_;  // by handle
  uint64_t tick_ = 1;
  double fast_length_ = 0;
  std::vector<FastMover> fast_;
  bool fast_changed_ = false;
  Displacement displacement_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_TICK_MOVES_H_
