#include "core/index/hash_grid/grid_snapshot.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/base/check.h"
#include "core/base/planted_bug.h"

namespace locus {
namespace internal {

KeyRange cells_near(const GridLevel& level, const Aabbd& region) {
  // The position of every value lies within the bounds of the level, so clipping the region to these bounds loses no
  // value. Clipping also keeps the cell indices in range. max_extent includes an allowance for rounding.
  const Aabbd& bounds = level.geometry.bounds;
  const Aabbd near = grown(region, level.geometry.max_extent);
  const Aabbd inside{max(near.min, bounds.min), min(near.max, bounds.max)};
  if (inside.min.x > inside.max.x || inside.min.y > inside.max.y || inside.min.z > inside.max.z)
    return {{0, 0, 0}, {-1, -1, -1}};
  return cells_within(inside, level.geometry.cells_per_unit);
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
                           internal::BrickIndices bricks_by_handle, double cell_size)
    : levels_(std::move(levels)),
      bricks_(std::move(bricks)),
      bricks_by_handle_(std::move(bricks_by_handle)),
      cell_size_(cell_size) {
  for (const internal::GridLevel& level : levels_) size_ += level.size;
  LOCUS_DCHECK_CALL(check_invariants());
}

void GridSnapshot::check_invariants() const {
  for (size_t i = 0; i < levels_.size(); ++i) {
    const internal::GridLevel& level = levels_[i];
    if (i != 0) LOCUS_DCHECK_GT(levels_[i - 1].exponent, level.exponent);
    LOCUS_DCHECK_GT(level.size, 0u);
    LOCUS_DCHECK(level.table != nullptr);
    LOCUS_DCHECK_LE(level.table->size(), level.size);
    LOCUS_DCHECK(!level.geometry.bounds.empty());
    LOCUS_DCHECK_GE(level.geometry.max_extent, 0.0);
    LOCUS_DCHECK_EQ(level.geometry.cells_per_unit, internal::cells_per_unit(level.exponent));
  }
  LOCUS_DCHECK(size_ <= bricks_by_handle_.size() || planted(PlantedBug::kGhostAfterMove));
}

GridRef GridSnapshot::find_in(const internal::Brick& brick, uint32_t handle) {
  // Searches the log first: a value that moved within the brick may still have a dead slot in `sorted`.
  if (const uint32_t slot = brick.find_recent(handle); slot != brick.recent_count)
    return {*brick.recent, slot, brick.index};
  const uint32_t slot = brick.sorted->find(handle);
  return slot == brick.sorted->count() || brick.is_dead(slot) ? GridRef() : GridRef(*brick.sorted, slot, brick.index);
}

GridRef GridSnapshot::at(uint32_t handle) const {
  LOCUS_DCHECK_LT(handle, bricks_by_handle_.size());
  const GridRef value = find_in(*bricks_[bricks_by_handle_[handle]], handle);
  LOCUS_CHECK(value);
  return value;
}

Aabbd GridSnapshot::outer_bounds(std::array<const internal::Brick*, 6>& extreme) const {
  Aabbd outer;
  for (const internal::GridLevel& level : levels_) {
    level.table->for_each([&](uint32_t index) {
      const internal::Brick& brick = *bricks_[index];
      const Aabbd box = internal::box_around_values(brick, brick.max_extent);
      for (int axis = 0; axis < 3; ++axis) {
        if (box.min[axis] < outer.min[axis]) extreme[static_cast<size_t>(axis)] = &brick;
        if (box.max[axis] > outer.max[axis]) extreme[static_cast<size_t>(axis) + 3] = &brick;
      }
      outer = merge(outer, box);
      return true;
    });
  }
  return outer;
}

GridBrickBounds GridSnapshot::brick_bounds(uint32_t brick) const {
  LOCUS_DCHECK_LT(brick, bricks_.size());
  return {internal::box_around_values(*bricks_[brick], 0), bricks_[brick]->max_extent};
}

GridRef GridSnapshot::find(uint32_t handle) const {
  if (handle >= bricks_by_handle_.size()) return {};
  const uint32_t index = bricks_by_handle_[handle];  // index of an earlier brick if the handle is not in use
  if (index >= bricks_.size() || bricks_[index] == nullptr) return {};
  return find_in(*bricks_[index], handle);
}

GridRef GridSnapshot::find_like(const GridRef& value) const {
  LOCUS_DCHECK(value);
  const uint32_t handle = value.handle();
  if (value.brick() < bricks_.size() && bricks_[value.brick()] != nullptr) {
    const internal::Brick& brick = *bricks_[value.brick()];
    const uint32_t slot = brick.sorted->find_near(handle, value.slot());
    if (slot < brick.sorted->count() && !brick.is_dead(slot)) return {*brick.sorted, slot, brick.index};
  }
  return find(handle);
}

const internal::GridLevel* GridSnapshot::level_at(const Vec3d& point) const {
  if (levels_.size() < 2) return nullptr;
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level) {
    const internal::GridKey cell = internal::cell_of(point, level->geometry.cells_per_unit);
    if (find_brick(*level, internal::brick_of(cell)) != nullptr) return &*level;
  }
  return nullptr;
}

double GridSnapshot::values_per_cell(const internal::GridLevel& level, const Vec3d& point) const {
  const Vec3d inside = nearest_in(point, level.geometry.bounds);
  const internal::Brick* brick =
      find_brick(level, internal::brick_of(internal::cell_of(inside, level.geometry.cells_per_unit)));
  const double nearby = brick == nullptr ? 0 : internal::values_per_cell(*brick, inside);
  return nearby > 0 ? nearby : internal::values_per_cell(level.geometry, level.size);
}

size_t GridSnapshot::unshared_bytes(const GridSnapshot& other) const {
  size_t bytes = bricks_.unshared_bytes(other.bricks_) + bricks_by_handle_.unshared_bytes(other.bricks_by_handle_);
  bricks_.for_each_apart_from(other.bricks_,
                              [&bytes](const internal::BrickPtr& brick, const internal::BrickPtr* theirs) {
                                if (brick != nullptr)
                                  bytes += brick->unshared_bytes(theirs == nullptr ? nullptr : theirs->get());
                              });
  for (const internal::GridLevel& level : levels_) {
    const bool shared = std::any_of(other.levels_.begin(), other.levels_.end(),
                                    [&level](const internal::GridLevel& one) { return one.table == level.table; });
    bytes += sizeof(level) + (shared ? 0 : level.table->bytes());
  }
  return bytes;
}

GridStatistics GridSnapshot::statistics() const {
  GridStatistics result;
  result.values = size_;
  result.levels = levels_.size();
  result.cell_size = cell_size_;
  for (const internal::GridLevel& level : levels_) {
    result.bricks += level.table->size();
    result.bytes += level.table->bytes();
    level.table->for_each([&](uint32_t index) {
      const internal::Brick& brick = *bricks_[index];
      result.bytes += brick.bytes();
      uint64_t occupied = 0;
      internal::for_each_value(brick, [&](GridRef value) {
        occupied |= uint64_t{1} << brick.geometry.cell_of(value.entry().position);
        return true;
      });
      result.cells += static_cast<size_t>(std::popcount(occupied));
      return true;
    });
  }
  return result;
}

}  // namespace locus
