#include "core/index/hash_grid/grid_snapshot.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace locus {
namespace internal {

KeyRange cells_near(const GridLevel& level, const Aabbd& region) {
  const Aabbd& bounds = level.extent.bounds;
  if (!overlaps(region, bounds)) return {{0, 0, 0}, {-1, -1, -1}};
  // Positions lie within the extent, so that the figures below are finite; the growth covers their rounding.
  const Aabbd inside{max(region.min, bounds.min), min(region.max, bounds.max)};
  const Aabbd near = grown(inside, level.extent.reach);
  return cells_within({max(near.min, bounds.min), min(near.max, bounds.max)}, level.extent.cells_per_unit);
}

KeyRange within_brick(const KeyRange& range, const GridKey& brick) {
  KeyRange cells;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t first = brick[axis] << kBrickBits;
    cells.lo[axis] = std::max<int64_t>(range.lo[axis] - first, 0);
    cells.hi[axis] = std::min<int64_t>(range.hi[axis] - first, (1 << kBrickBits) - 1);
  }
  return cells;
}

}  // namespace internal

GridSnapshot::GridSnapshot(std::vector<internal::GridLevel> levels, internal::BrickArray bricks,
                           internal::BrickNumbers bricks_by_handle, double cell_size)
    : levels_(std::move(levels)),
      bricks_(std::move(bricks)),
      bricks_by_handle_(std::move(bricks_by_handle)),
      cell_size_(cell_size) {
  for (const internal::GridLevel& level : levels_) size_ += level.size;
}

GridRef GridSnapshot::at(uint32_t handle) const {
  const internal::Brick& brick = *bricks_[bricks_by_handle_[handle]];
  // A value that moved within the brick may lie in both; the one in `sorted` is gone then.
  if (brick.recent != nullptr) {
    const uint32_t slot = brick.recent->find(handle);
    if (slot != brick.recent->count()) return {*brick.recent, slot};
  }
  const uint32_t slot = brick.sorted->find(handle);
  LOCUS_CHECK_LT(slot, brick.sorted->count());
  return {*brick.sorted, slot};
}

GridStatistics GridSnapshot::statistics() const {
  GridStatistics result;
  result.values = size_;
  result.levels = levels_.size();
  result.cell_size = cell_size_;
  for (const internal::GridLevel& level : levels_) {
    result.bricks += level.table->size();
    result.bytes += level.table->bytes();
    level.table->for_each([&](uint32_t number) {
      const internal::Brick& brick = *bricks_[number];
      result.bytes += brick.bytes();
      uint64_t occupied = 0;
      internal::for_each_value(brick, [&](GridRef value) {
        occupied |= uint64_t{1} << brick.place.cell_of(value.entry().position);
        return true;
      });
      result.cells += static_cast<size_t>(std::popcount(occupied));
      return true;
    });
  }
  return result;
}

}  // namespace locus
