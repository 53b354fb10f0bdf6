// What the next version of a brick is made from. For the one writer of a grid.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_SOURCES_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_SOURCES_H_

#include <algorithm>

#include "absl/types/span.h"
#include "core/index/hash_grid/brick.h"

namespace locus {

// A new pose for a value that the grid holds.
struct alignas(32) GridMove {
  static constexpr uint32_t kKeeps = ~0u;

  Vec3d position;
  uint32_t handle = 0;
  uint32_t rotation = kKeeps;  // the number of its new one among the batch's
};

// The moves of a batch. All borrowed.
struct GridMoves {
  absl::Span<const GridMove> moves;  // of distinct handles
  absl::Span<const Quaternion> rotations = {};
  // By handle the number of its move; means nothing for a handle that moves[number] is not of. May be empty: with it,
  // moves of nearly all values cost less.
  absl::Span<const uint32_t> by_handle = {};
};

namespace internal {

// Where the writer finds a value again.
struct GridSlot {
  static constexpr uint32_t kRecent = 1u << 31;  // in `slot`: of Brick::recent, else of Brick::sorted

  uint32_t brick = 0;
  uint32_t slot = 0;
};

// A value of the next version of a brick.
struct BrickSource {
  static constexpr uint32_t kArrival = 1u << 30;  // in `origin`: an arrival's number, else as GridSlot::slot
  static constexpr uint32_t kNoMove = ~0u;

  uint32_t origin;
  uint32_t move;  // its number; kNoMove where the value stays as it was
  uint32_t cell;  // where it is to be; not of what goes to the recent values
};

// The moves of a batch, as values ask for them. There are some, by handle, too.
class MoveFinder {
 public:
  explicit MoveFinder(const GridMoves& moves) : moves_(moves.moves), numbers_(moves.by_handle) {}

  // Of any handle; it may be the number of another one's move.
  uint32_t number_of(uint32_t handle) const {
    const uint32_t number = handle < numbers_.size() ? numbers_[handle] : 0;
    return number < moves_.size() ? number : 0;
  }
  const GridMove& operator[](uint32_t number) const { return moves_.data()[number]; }

 private:
  absl::Span<const GridMove> moves_;
  absl::Span<const uint32_t> numbers_;
};

// Writes what remains of the first `count` values of a block to `to`, which has room for all, but for those that
// is_gone(slot); leave(block, slot, move) for each that moves out of the brick. Adds to `moved` how many move, those
// included. Returns the end of what it wrote.
template <class IsGone, class Leave>
BrickSource* gather_block(const BrickPlace& place, const GridBlock& block, uint32_t count, uint32_t flag,
                          const MoveFinder& moves, BrickSource* to, size_t& moved, const IsGone& is_gone,
                          const Leave& leave) {
  constexpr uint32_t kAtOnce = 16;  // whose moves are on their way before they are needed
  uint32_t numbers[kAtOnce];
  for (uint32_t begin = 0; begin < count; begin += kAtOnce) {
    const uint32_t end = std::min(count, begin + kAtOnce);
    for (uint32_t slot = begin; slot < end; ++slot) {
      numbers[slot - begin] = moves.number_of(block.handle(slot));
      __builtin_prefetch(&moves[numbers[slot - begin]]);
    }
    for (uint32_t slot = begin; slot < end; ++slot) {
      if (is_gone(slot)) continue;
      const uint32_t number = numbers[slot - begin];
      const GridMove& move = moves[number];
      if (move.handle != block.handle(slot)) {
        const Vec3d position = block.entry(slot).position;
        *to++ = {slot | flag, BrickSource::kNoMove, static_cast<uint32_t>(place.cell_of(position))};
        continue;
      }
      ++moved;
      if (const int cell = place.cell_if_here(move.position); cell >= 0) {
        *to++ = {slot | flag, number, static_cast<uint32_t>(cell)};
      } else {
        leave(block, slot, move);
      }
    }
  }
  return to;
}

// The same of a brick.
template <class Leave>
BrickSource* gather_brick(const Brick& brick, const MoveFinder& moves, BrickSource* to, size_t& moved,
                          const Leave& leave) {
  const BrickPlace place = brick.place;  // a copy, so that nothing written can change it
  const auto stays = [](uint32_t) { return false; };
  const auto is_gone = [&brick](uint32_t slot) { return brick.is_gone(slot); };
  const auto is_recent_gone = [&brick](uint32_t slot) { return brick.is_recent_gone(slot); };
  const GridBlock& sorted = *brick.sorted;
  to = brick.gone_count == 0 ? gather_block(place, sorted, sorted.count(), 0, moves, to, moved, stays, leave)
                             : gather_block(place, sorted, sorted.count(), 0, moves, to, moved, is_gone, leave);
  if (brick.recent_count == 0) return to;
  return gather_block(place, *brick.recent, brick.recent_count, GridSlot::kRecent, moves, to, moved, is_recent_gone,
                      leave);
}

}  // namespace internal
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_SOURCES_H_
