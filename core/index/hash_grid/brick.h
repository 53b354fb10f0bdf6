// Bricks, the unit in which the hash grid stores and shares values: 4x4x4 cells with one sorted block of values, and
// the few values that came or moved since that block was sorted. Immutable once shared; any thread. A small batch
// replaces the few, a large one or many small ones sort the block anew.
//
// Invariants: a value is alive in `sorted` (its bit in `gone` is not set) or in `recent`, never in both; every value
// lies in this brick by its position; `gone` is empty or has a bit for each value of `sorted` and 64 more.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_

#include <algorithm>
#include <memory>
#include <vector>

#include "absl/types/span.h"
#include "core/index/hash_grid/cell_key.h"
#include "core/index/hash_grid/grid_block.h"

namespace locus::internal {

// Where the brick lies: fixed from its first version to its last.
struct BrickPlace {
  GridKey key;
  int exponent = 0;  // of the cell edge
  double cells_per_unit = 1;
  Vec3d low, center, high;  // exact
  double edge = 0;          // of the brick

  static BrickPlace of(const GridKey& key, int exponent);
  // The cell within the brick of a position in it.
  int cell_of(Vec3d position) const {
    return cell_along(position.x - low.x) | cell_along(position.y - low.y) << kBrickBits |
           cell_along(position.z - low.z) << (2 * kBrickBits);
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
  BrickPlace place;
  uint32_t number = 0;                      // in the list of bricks, from its first version to its last
  std::shared_ptr<const GridBlock> sorted;  // never null
  std::shared_ptr<const GridBlock> recent;  // null when there are none
  std::vector<uint64_t> gone;
  uint32_t gone_count = 0;

  uint32_t size() const { return sorted->count() - gone_count + (recent == nullptr ? 0 : recent->count()); }
  bool is_gone(uint32_t slot) const { return !gone.empty() && (gone[slot / 64] >> (slot % 64) & 1) != 0; }
  float largest_reach() const {
    return recent == nullptr ? sorted->largest_reach() : std::max(sorted->largest_reach(), recent->largest_reach());
  }
  size_t bytes() const { return own_bytes() + sorted->bytes(); }
  // Without the sorted block, which other versions may share.
  size_t own_bytes() const {
    return sizeof(Brick) + (recent == nullptr ? 0 : recent->bytes()) + gone.size() * sizeof(gone[0]);
  }
  // Without what `other`, perhaps a later version of this brick, shares; null shares nothing.
  size_t bytes_apart_from(const Brick* other) const {
    if (other == this) return 0;
    if (other == nullptr) return bytes();
    return bytes() - (sorted == other->sorted ? sorted->bytes() : 0) -
           (recent != nullptr && recent == other->recent ? recent->bytes() : 0);
  }
};

using BrickPtr = std::shared_ptr<const Brick>;

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_
