// Bricks, the unit in which the hash grid stores and shares values: 4x4x4 cells with one sorted block of values, and
// a log of the few values that came or moved since that block was sorted. Immutable once shared; any thread. A small
// batch makes a version that shares both blocks: it adds to the log what earlier versions do not know of, and marks
// what is gone from either. A large one, or many small ones, sort everything anew.
//
// Invariants: a value is alive in `sorted` (its bit in `gone` is not set) or in `recent` (likewise), never in both and
// never twice; every value lies in this brick by its position; `gone` is empty or has a bit for each value of `sorted`
// and 64 more.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_

#include <algorithm>
#include <array>
#include <memory>

#include "absl/container/inlined_vector.h"
#include "core/index/hash_grid/cell_key.h"
#include "core/index/hash_grid/grid_block.h"

namespace locus::internal {

// Where the brick lies: fixed from its first version to its last.
struct BrickPlace {
  GridKey key;
  Vec3d center;  // exact, as low and high
  double edge = 0;
  Vec3d low, high;
  double cells_per_unit = 1;
  int exponent = 0;  // of the cell edge

  static BrickPlace of(const GridKey& key, int exponent);
  // The cell within the brick of a position in it.
  int cell_of(Vec3d position) const {
    return cell_along(position.x - low.x) | cell_along(position.y - low.y) << kBrickBits |
           cell_along(position.z - low.z) << (2 * kBrickBits);
  }
  // Both in one: the cell of a position in the brick, and something negative for one that is not, but for the same
  // rounding at its borders.
  int cell_if_here(Vec3d position) const {
    // One more than the cells, so that what is before the first is not rounded into it.
    const int64_t x = static_cast<int64_t>((position.x - low.x) * cells_per_unit + 1) - 1;
    const int64_t y = static_cast<int64_t>((position.y - low.y) * cells_per_unit + 1) - 1;
    const int64_t z = static_cast<int64_t>((position.z - low.z) * cells_per_unit + 1) - 1;
    if (((x | y | z) & ~((int64_t{1} << kBrickBits) - 1)) != 0) return -1;
    return static_cast<int>(x | y << kBrickBits | z << (2 * kBrickBits));
  }
  // As brick_of() its cell says. No branches.
  bool holds(Vec3d position) const {
    return ((position.x >= low.x) & (position.x < high.x) & (position.y >= low.y) & (position.y < high.y) &
            (position.z >= low.z) & (position.z < high.z)) != 0;
  }
  // The cell on one axis. Next to the border of two it may be the other, by the rounding of the difference: every query
  // looks farther than that beyond what it needs.
  int cell_along(double from_low) const {
    return std::clamp(static_cast<int>(from_low * cells_per_unit), 0, (1 << kBrickBits) - 1);
  }
};

struct Brick {
  static constexpr uint32_t kMaxRecent = 128;

  // What every query reads comes first.
  uint32_t number = 0;                      // in the list of bricks, from its first version to its last
  float largest_reach = 0;                  // no value here has a larger one
  std::shared_ptr<const GridBlock> sorted;  // never null
  std::shared_ptr<GridBlock> recent;        // a log; null when recent_count is 0
  uint32_t gone_count = 0;
  uint32_t recent_count = 0;  // this version's share of the log
  uint32_t recent_gone_count = 0;
  BrickPlace place;
  std::array<uint64_t, kMaxRecent / 64 + 1> recent_gone{};
  static constexpr size_t kGoneInPlace = 20;
  absl::InlinedVector<uint64_t, kGoneInPlace> gone;

  // How many values the log of changes holds: by the number of sorted ones, so that it stays a part of the memory.
  uint32_t recent_room() const { return std::clamp(sorted->count() / 2, 16u, kMaxRecent); }
  uint32_t size() const { return sorted->count() - gone_count + recent_count - recent_gone_count; }
  bool is_gone(uint32_t slot) const { return !gone.empty() && (gone[slot / 64] >> (slot % 64) & 1) != 0; }
  bool is_recent_gone(uint32_t slot) const { return (recent_gone[slot / 64] >> (slot % 64) & 1) != 0; }
  // The slot in `recent` of a handle's value; recent_count if it is not there.
  uint32_t find_recent(uint32_t handle) const {
    if (recent_count == 0) return 0;
    const uint32_t slot = recent->find_last(handle, recent_count);
    return slot == recent_count || is_recent_gone(slot) ? recent_count : slot;
  }
  // Ask for the memory of the brick, and of what its blocks are, before it is needed. GCC drops calls of what only
  // prefetches unless it is inlined early.
  [[gnu::always_inline]] void prefetch() const {
    for (size_t line = 0; line < sizeof(Brick); line += 64)
      __builtin_prefetch(reinterpret_cast<const char*>(this) + line);
  }
  [[gnu::always_inline]] void prefetch_head() const {
    __builtin_prefetch(this);
    __builtin_prefetch(&place.center);
    __builtin_prefetch(&place.edge);
  }
  [[gnu::always_inline]] void prefetch_blocks() const {
    __builtin_prefetch(sorted.get());
    if (recent != nullptr) __builtin_prefetch(recent.get());
  }

  size_t bytes() const { return unshared_bytes(nullptr); }
  // Without what `other`, perhaps a later version of this brick, shares; null shares nothing.
  size_t unshared_bytes(const Brick* other) const {
    if (other == this) return 0;
    const bool shares_sorted = other != nullptr && sorted == other->sorted;
    const bool shares_recent = recent == nullptr || (other != nullptr && recent == other->recent);
    return sizeof(Brick) + (gone.size() <= kGoneInPlace ? 0 : gone.size() * sizeof(gone[0])) +
           (shares_sorted ? 0 : sorted->bytes()) + (shares_recent ? 0 : recent->bytes());
  }
};

using BrickPtr = std::shared_ptr<const Brick>;

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_
