// Brick: the unit in which the hash grid stores and shares values. A brick covers 4x4x4 cells. It has two blocks of
// values: the sorted block, ordered by cell, and the log, which holds the few values that were inserted or moved since
// the sorted block was made. A Brick object is one version of a brick. A small batch makes a version that shares both
// blocks with the previous version: the batch appends values to the log and marks the replaced and removed slots of
// both blocks as dead. A large batch, or a full log, sorts all values into a new block.
//
// Threads: a version is immutable once shared; any thread.
//
// Invariants: each value is alive (its bit in `dead` or `recent_dead` is clear) in exactly one slot of `sorted` or
// `recent`; the position of every live value lies in the brick; `dead` is empty or has a bit for each slot of `sorted`
// and at least 64 more bits; dead_count and recent_dead_count equal the number of bits set in `dead` and `recent_dead`.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_

#include <algorithm>
#include <array>
#include <memory>

#include "absl/container/inlined_vector.h"
#include "core/index/hash_grid/cell_key.h"
#include "core/index/hash_grid/grid_block.h"

namespace locus::internal {

// Position and size of a brick: equal in all versions of the brick.
struct BrickGeometry {
  GridKey key;
  Vec3d center;  // centre of the brick; `center`, `low` and `high` are exact in double
  double edge = 0;
  Vec3d low, high;
  double cells_per_unit = 1;
  int exponent = 0;  // cell edge = 2^exponent

  static BrickGeometry of(const GridKey& key, int exponent);
  // Returns the index, 0 to 63 as in index_in_brick(), of the cell that contains a position in the brick.
  int cell_of(Vec3d position) const {
    return cell_along(position.x - low.x) | cell_along(position.y - low.y) << kBrickBits |
           cell_along(position.z - low.z) << (2 * kBrickBits);
  }
  // Returns the index of the cell that contains the position, or a negative value if the position is not in the brick.
  // Faster than holds() followed by cell_of(). If the position is so close to a border of the brick that rounding
  // decides, the result may disagree with holds().
  int cell_if_here(Vec3d position) const {
    // Adds 1 before the cast, which rounds toward zero: positions just below the brick must not become cell 0.
    const int64_t x = static_cast<int64_t>((position.x - low.x) * cells_per_unit + 1) - 1;
    const int64_t y = static_cast<int64_t>((position.y - low.y) * cells_per_unit + 1) - 1;
    const int64_t z = static_cast<int64_t>((position.z - low.z) * cells_per_unit + 1) - 1;
    if (((x | y | z) & ~((int64_t{1} << kBrickBits) - 1)) != 0) return -1;
    return static_cast<int>(x | y << kBrickBits | z << (2 * kBrickBits));
  }
  // Returns true if the position lies in the brick; equals brick_of(internal::cell_of(position, cells_per_unit)) ==
  // key. Branch-free.
  bool holds(Vec3d position) const {
    return ((position.x >= low.x) & (position.x < high.x) & (position.y >= low.y) & (position.y < high.y) &
            (position.z >= low.z) & (position.z < high.z)) != 0;
  }
  // Return true if the position lies in `cell` (cell_nearly_holds) or in the brick (nearly_holds), up to the rounding
  // error of cell_along(). Only for debug checks.
  bool cell_nearly_holds(int cell, Vec3d position) const;
  bool nearly_holds(Vec3d position) const;
  // Returns the coordinate of a cell within the brick on one axis, 0 to 3. `from_low` is the distance of a position
  // from the low side of the brick. Close to the border of two cells, the rounding error of `from_low` may select the
  // wrong cell; every query widens its range by more than this error.
  int cell_along(double from_low) const {
    return std::clamp(static_cast<int>(from_low * cells_per_unit), 0, (1 << kBrickBits) - 1);
  }
};

struct Brick {
  static constexpr uint32_t kMaxRecent = 128;

  // The members that every query reads come first.
  uint32_t index = 0;                       // index of the brick in the grid's array, equal in all versions
  float max_extent = 0;                     // upper bound of the extents of the brick's values
  std::shared_ptr<const GridBlock> sorted;  // values sorted by cell; never null
  std::shared_ptr<GridBlock> recent;        // log; null if recent_count is 0
  uint32_t dead_count = 0;
  uint32_t recent_count = 0;  // number of slots of the log that belong to this version
  uint32_t recent_dead_count = 0;
  BrickGeometry geometry;
  std::array<uint64_t, kMaxRecent / 64 + 1> recent_dead{};
  static constexpr size_t kInlineDeadWords = 20;
  absl::InlinedVector<uint64_t, kInlineDeadWords> dead;

  // Returns the capacity of the log: half the number of sorted values, clamped to [16, kMaxRecent]. So logs use only a
  // bounded share of the memory.
  uint32_t recent_room() const { return std::clamp(sorted->count() / 2, 16u, kMaxRecent); }
  uint32_t size() const { return sorted->count() - dead_count + recent_count - recent_dead_count; }
  bool is_dead(uint32_t slot) const { return !dead.empty() && (dead[slot / 64] >> (slot % 64) & 1) != 0; }
  bool is_recent_dead(uint32_t slot) const { return (recent_dead[slot / 64] >> (slot % 64) & 1) != 0; }
  // Returns the slot of the live value of `handle` in `recent`, or recent_count if `recent` has no such value.
  uint32_t find_recent(uint32_t handle) const {
    if (recent_count == 0) return 0;
    const uint32_t slot = recent->find_last(handle, recent_count);
    return slot == recent_count || is_recent_dead(slot) ? recent_count : slot;
  }
  // Prefetch memory of the brick: prefetch() loads this whole struct, prefetch_head() loads its most used cache lines,
  // and prefetch_blocks() loads the headers of both blocks. Always inlined, since GCC otherwise drops calls of
  // functions that only prefetch.
  [[gnu::always_inline]] void prefetch() const {
    for (size_t line = 0; line < sizeof(Brick); line += 64)
      __builtin_prefetch(reinterpret_cast<const char*>(this) + line);
  }
  [[gnu::always_inline]] void prefetch_head() const {
    __builtin_prefetch(this);
    __builtin_prefetch(&geometry.center);
    __builtin_prefetch(&geometry.edge);
  }
  [[gnu::always_inline]] void prefetch_blocks() const {
    __builtin_prefetch(sorted.get());
    if (recent != nullptr) __builtin_prefetch(recent.get());
  }

  size_t bytes() const { return unshared_bytes(nullptr); }
  // Returns the size in bytes of the parts of this version that are not shared with `other`, for example a later
  // version of the brick. If `other` is null, no part is shared.
  size_t unshared_bytes(const Brick* other) const {
    if (other == this) return 0;
    const bool shares_sorted = other != nullptr && sorted == other->sorted;
    const bool shares_recent = recent == nullptr || (other != nullptr && recent == other->recent);
    return sizeof(Brick) + (dead.size() <= kInlineDeadWords ? 0 : dead.size() * sizeof(dead[0])) +
           (shares_sorted ? 0 : sorted->bytes()) + (shares_recent ? 0 : recent->bytes());
  }

  // Checks the blocks, the counts and the dead bits of a complete version. O(words of dead bits), no more than the cost
  // of copying a version.
  void check_invariants() const;
};

using BrickPtr = std::shared_ptr<const Brick>;

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_
