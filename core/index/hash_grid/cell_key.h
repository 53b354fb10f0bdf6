// Keys of cells and bricks: a cell of one level has an edge of 2^exponent, and its key is a 64-bit integer per axis; a
// brick is 4x4x4 cells. Plain functions without state; any thread. Cell edges are powers of two, so scaling a
// coordinate is exact, and a larger coordinate never has a smaller index.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_CELL_KEY_H_
#define LOCUS_CORE_INDEX_HASH_GRID_CELL_KEY_H_

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/aabb.h"

namespace locus::internal {

inline constexpr int kMinCellExponent = -20;  // min for the base level; about a micrometre if the unit is a metre
inline constexpr int kMaxBaseExponent = 31;   // max for the base level; such a cell is wider than the world
inline constexpr int kMaxCellExponent = 40;   // max for any level; a level of this exponent also stores wider values
inline constexpr int kBrickBits = 2;          // a brick is 2^kBrickBits cells wide
inline constexpr double kMaxCellIndex =
    0x1p+62;  // limit of indices, far outside the world, so that every cast is defined

// Integer coordinates of a cell or a brick of one level.
struct GridKey {
  int64_t x = 0, y = 0, z = 0;

  int64_t operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  int64_t& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  friend constexpr auto operator<=>(const GridKey&, const GridKey&) = default;
};

// Hash of a key. The hash of a key is equal in every process, so the order of visits and the work counters are
// reproducible.
struct GridKeyHash {
  static constexpr uint64_t mix(uint64_t h) {
    h = (h ^ (h >> 30)) * 0xBF58476D1CE4E5B9u;
    h = (h ^ (h >> 27)) * 0x94D049BB133111EBu;
    return h ^ (h >> 31);
  }
  size_t operator()(const GridKey& key) const {
    return mix(static_cast<uint64_t>(key.x) * 0x9E3779B97F4A7C15u + static_cast<uint64_t>(key.y) * 0xD6E8FEB86659FD93u +
               static_cast<uint64_t>(key.z) * 0xA0761D6478BD642Fu);
  }
};

inline int64_t to_cell_index(double scaled) {
  return static_cast<int64_t>(std::clamp(scaled, -kMaxCellIndex, kMaxCellIndex));
}

// Returns the inverse of the cell edge, exactly. The parameter `per_unit` of the functions below is this value.
inline double cells_per_unit(int exponent) { return std::ldexp(1.0, -exponent); }

// Returns the index of the cell that contains `coordinate` on one axis. Does not use std::floor(), which is a library
// call without SSE4.1.
inline int64_t cell_index(double coordinate, double per_unit) {
  const double scaled = std::clamp(coordinate * per_unit, -kMaxCellIndex, kMaxCellIndex);
  const auto towards_zero = static_cast<int64_t>(scaled);
  return towards_zero - static_cast<int64_t>(scaled < static_cast<double>(towards_zero));
}
inline int64_t brick_index(double coordinate, double per_unit) {
  return cell_index(coordinate, per_unit) >> kBrickBits;
}

// Returns the cell in which a value at `position` is stored.
inline GridKey cell_of(Vec3d position, double per_unit) {
  GridKey cell;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = planted(PlantedBug::kUnsignedCellIndex) ? to_cell_index(position[axis] * per_unit)
                                                         : cell_index(position[axis], per_unit);
  }
  return cell;
}

inline GridKey brick_of(const GridKey& cell) {
  return {cell.x >> kBrickBits, cell.y >> kBrickBits, cell.z >> kBrickBits};
}

// Returns the index of a cell within its brick, 0 to 63: x + 4 y + 16 z for the coordinates 0 to 3 of the cell in the
// brick.
inline int index_in_brick(const GridKey& cell) {
  constexpr int64_t kMask = (int64_t{1} << kBrickBits) - 1;
  return static_cast<int>((cell.x & kMask) | (cell.y & kMask) << kBrickBits | (cell.z & kMask) << (2 * kBrickBits));
}

// Returns the smallest e with 2^e >= `length`, clamped to [min_exponent, max_exponent].
inline int exponent_covering(double length, int min_exponent, int max_exponent) {
  LOCUS_DCHECK_LE(min_exponent, max_exponent);
  if (!(length > 0)) return min_exponent;
  int exponent = 0;
  const double mantissa = std::frexp(length, &exponent);  // in [0.5, 1)
  return std::clamp(mantissa == 0.5 ? exponent - 1 : exponent, min_exponent, max_exponent);
}

// Returns the extent of a value: the largest distance from its position to its bounds along any axis.
inline double extent_of(const Aabbd& bounds, Vec3d position) {
  return std::max(max_component(position - bounds.min), max_component(bounds.max - position));
}

// Box of keys of bricks or cells: on each axis from `lo` to `hi`, both included.
struct KeyRange {
  GridKey lo, hi;

  bool empty() const { return lo.x > hi.x || lo.y > hi.y || lo.z > hi.z; }
  double count() const {  // in double, since the count may exceed 64 bits
    return (static_cast<double>(hi.x - lo.x) + 1) * (static_cast<double>(hi.y - lo.y) + 1) *
           (static_cast<double>(hi.z - lo.z) + 1);
  }
  bool contains(const GridKey& key) const {
    return lo.x <= key.x && key.x <= hi.x && lo.y <= key.y && key.y <= hi.y && lo.z <= key.z && key.z <= hi.z;
  }
};

// Returns the cells of one level that contain the positions within `box`. Precondition: the box is not empty.
inline KeyRange cells_within(const Aabbd& box, double per_unit) {
  LOCUS_DCHECK(!box.empty());
  KeyRange range;
  for (int axis = 0; axis < 3; ++axis) {
    range.lo[axis] = cell_index(box.min[axis], per_unit);
    range.hi[axis] = cell_index(box.max[axis], per_unit);
  }
  return range;
}

// Return the bricks that contain the cells of a range (bricks_of) or the positions within a box (bricks_within).
inline KeyRange bricks_of(const KeyRange& cells) { return {brick_of(cells.lo), brick_of(cells.hi)}; }
inline KeyRange bricks_within(const Aabbd& box, double per_unit) { return bricks_of(cells_within(box, per_unit)); }

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_CELL_KEY_H_
