#include "core/index/hash_grid/region_walk.h"

namespace locus {
namespace internal {
namespace {

constexpr size_t kLine = 64;

void prefetch(const void* from, size_t bytes) {
  for (size_t at = 0; at < bytes; at += kLine) __builtin_prefetch(static_cast<const char*>(from) + at);
}

void prefetch_rows(const GridRows& rows) {
  for (const float* column : {rows.x, rows.y, rows.z, rows.extent})
    for (uint32_t row = 0; row < rows.count; ++row)
      prefetch(column + rows.begin[row], (rows.end[row] - rows.begin[row]) * sizeof(float));
}

}  // namespace

void RegionSteps::find_bricks(const GridRegion& region) {
  LOCUS_DCHECK(region.grid != nullptr);
  region_ = region;
  part_count_ = slot_count_ = 0;
  Work work;
  is_small_ =
      region.grid->for_few_bricks(region.bounds, kMaxBricks, work, [&](const Brick& brick, const KeyRange& cells) {
        LOCUS_DCHECK_LT(part_count_, kMaxBricks);
        brick.prefetch_head();
        parts_[part_count_].brick = &brick;
        parts_[part_count_].later = region.later == nullptr ? nullptr : region.later->version_of(brick);
        if (parts_[part_count_].later != nullptr) parts_[part_count_].later->prefetch_head();
        parts_[part_count_++].cells = cells;
      });
  cells_ = work.cells;
}

void RegionSteps::find_blocks() {
  if (!is_small_) return;
  for (uint32_t i = 0; i < part_count_; ++i) {
    const BrickPart& part = parts_[i];
    const GridBlock& sorted = *part.brick->sorted;
    __builtin_prefetch(&sorted);
    for (int64_t z = part.cells.lo.z; z <= part.cells.hi.z; ++z) {
      const auto layer = static_cast<size_t>(z) << (2 * kBrickBits);
      __builtin_prefetch(&sorted.offsets()[layer]);
      __builtin_prefetch(&sorted.offsets()[layer + (1 << (2 * kBrickBits))]);
    }
    if (part.brick->recent_count != 0) __builtin_prefetch(part.brick->recent.get());
    if (part.later != nullptr) part.later->prefetch_blocks();
  }
}

void RegionSteps::find_rows() {
  if (!is_small_) return;
  for (uint32_t i = 0; i < part_count_; ++i) {
    BrickPart& part = parts_[i];
    part.rows = rows_of(*part.brick, part.cells);
    prefetch_rows(part.rows);
    if (part.later != nullptr) {
      const GridBlock& later = *part.later->sorted;
      for (uint32_t row = 0; row < part.rows.count; ++row)
        later.prefetch_handles(part.rows.begin[row], part.rows.end[row]);
    }
    if (part.brick->recent_count == 0) continue;
    for (int column = 0; column < 4; ++column)
      prefetch(part.brick->recent->column(column), part.brick->recent_count * sizeof(float));
  }
}

void RegionSteps::find_values() {
  if (!is_small_) return;
  if (region_.ball)
    cull(BallCull(*region_.ball, region_.marks));
  else
    cull(BoxCull(region_.bounds, region_.marks));
  prefetch_later_values();
}

// Prefetches the later versions of the found values that are near their present slots.
void RegionSteps::prefetch_later_values() const {
  if (!is_small_ || region_.later == nullptr) return;
  uint32_t next = 0;
  for (uint32_t i = 0; i < part_count_; ++i) {
    const BrickPart& part = parts_[i];
    if (part.later != nullptr) {
      const GridBlock& sorted = *part.brick->sorted;
      const GridBlock& later = *part.later->sorted;
      for (; next < part.sorted_end; ++next) {
        const uint32_t slot = later.find_near(sorted.handle(slots_[next] & ~kInsideMark), slots_[next] & ~kInsideMark);
        if (slot < later.count()) later.prefetch_entry(slot);
      }
    }
    next = part.recent_end;
  }
}

template <class CullOf>
void RegionSteps::cull(const CullOf& cull_of) {
  Work work;
  const auto keep = [this](const GridRef& value) {
    if (slot_count_ == kMaxValues) return false;
    slots_[slot_count_++] = value.slot() | (value.is_inside() ? kInsideMark : 0);
    return true;
  };
  for (uint32_t i = 0; is_small_ && i < part_count_; ++i) {
    BrickPart& part = parts_[i];
    const Brick& brick = *part.brick;
    const auto cull = cull_of(brick);
    is_small_ = scan_rows(*brick.sorted, brick.index, part.rows, work, cull, keep);
    part.sorted_end = slot_count_;
    is_small_ = is_small_ && scan_recent(brick, work, cull, keep);
    part.recent_end = slot_count_;
  }
  cells_ += work.cells;
}

}  // namespace internal

RegionWalk::RegionWalk(size_t begin, size_t end, std::function<GridRegion(size_t)> region_of)
    : region_of_(std::move(region_of)), next_(begin), end_(end) {
  LOCUS_DCHECK_LE(begin, end);
  for (size_t ahead = 0; ahead < kAhead; ++ahead) {
    for (size_t step = 0; step <= ahead; ++step) take_step(begin + ahead - step, step);
  }
}

void RegionWalk::take_steps() {
  for (size_t step = 0; step < kAhead; ++step) take_step(next_ + kAhead - step, step);
}

void RegionWalk::take_step(size_t region, size_t step) {
  if (region >= end_) return;
  internal::RegionSteps& steps = steps_[region % steps_.size()];
  switch (step) {
    case 0:
      return steps.find_bricks(region_of_(region));
    case 1:
      return steps.find_blocks();
    case 2:
      return steps.find_rows();
    default:
      return steps.find_values();
  }
}

}  // namespace locus
