// Goes through the values of one brick, or of some of its cells: float culls them eight at a time, and what remains is
// handed to the caller. Plain functions; any thread.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_SCAN_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_SCAN_H_

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/planted_bug.h"
#include "core/geometry/ball.h"
#include "core/geometry/ray.h"
#include "core/index/hash_grid/brick.h"
#include "core/index/hash_grid/kernels/grid_dispatch.h"
#include "core/index/hash_grid/slab_march.h"
#include "core/index/work.h"

namespace locus {

// A value in the grid. Borrows from the snapshot that gave it.
class GridRef {
 public:
  GridRef() = default;
  GridRef(const internal::GridBlock& block, uint32_t slot, uint32_t brick)
      : block_(&block), slot_(slot), brick_(brick) {}

  explicit operator bool() const { return block_ != nullptr; }
  const GridEntry& entry() const { return block_->entry(slot_); }
  uint32_t handle() const { return block_->handle(slot_); }
  float reach() const { return block_->reach(slot_); }
  GridForm form() const { return block_->form(slot_); }
  GridItem item() const { return block_->item(slot_); }
  // Where it lies: its place in its block, and the number of its brick.
  uint32_t slot() const { return slot_; }
  uint32_t brick() const { return brick_; }

 private:
  const internal::GridBlock* block_ = nullptr;
  uint32_t slot_ = 0;
  uint32_t brick_ = 0;
};

namespace internal {

// Bounds of values are wider than their reach by the rounding of predicates: 2^-40 of the magnitudes, as
// core/geometry/shape.h says. This much of the magnitudes covers that and the sums here.
inline constexpr double kBoundsGrowth = 0x1p-38;

inline constexpr KeyRange kAllCells{{0, 0, 0}, {3, 3, 3}};

// How much wider than its reach a value of `brick` may be, and how far off its columns in float.
inline double cull_margin(const Brick& brick) {
  const double coordinate = brick.place.edge;  // twice the largest of the float columns
  const double reach = brick.largest_reach;
  const double magnitude = max_component(abs(brick.place.center)) + brick.place.edge;
  return double{kCullSlack} * (coordinate + reach) + kBoundsGrowth * (magnitude + reach);
}

// Contains the bounds of every value of the brick, of which none extends farther than `reach` from its position.
inline Aabbd box_of_values(const Brick& brick, double reach) {
  const BrickPlace& place = brick.place;
  const double half = place.edge / 2 + reach;
  return grown(Aabbd{place.center, place.center}, half + kBoundsGrowth * (max_component(abs(place.center)) + half));
}

inline GridBox cull_box_of(const Brick& brick, const Aabbd& region) {
  const double margin = cull_margin(brick);
  GridBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = region.min[axis] - brick.place.center[axis] - margin;
    const double high = region.max[axis] - brick.place.center[axis] + margin;
    box.low[axis] = static_cast<float>(low - std::abs(low) * double{kCullSlack});
    box.high[axis] = static_cast<float>(high + std::abs(high) * double{kCullSlack});
  }
  return box;
}

inline GridBall cull_ball_of(const Brick& brick, const Balld& ball) {
  const Vec3d center = ball.center - brick.place.center;
  const double magnitude = max_component(abs(center)) + brick.place.edge + ball.radius + brick.largest_reach;
  GridBall cull;
  for (int axis = 0; axis < 3; ++axis) cull.center[axis] = static_cast<float>(center[axis]);
  if (planted(PlantedBug::kGridBallMargin))
    return {{cull.center[0], cull.center[1], cull.center[2]}, static_cast<float>(ball.radius)};
  // The differences, squares and their sum below are off by less than four 2^-24 of the distance.
  cull.radius = static_cast<float>((ball.radius + cull_margin(brick) + 4 * double{kCullSlack} * magnitude) *
                                   (1 + 2 * double{kCullSlack}));
  return cull;
}

// The ray as seen from the brick: its line by the point nearest to the centre, so that the numbers are small.
class CullRay {
 public:
  // `ray_margin`: how far values may be beside where they are filed, and the pad of the ray's slabs.
  CullRay(const Brick& brick, const SlabRay<double>& ray, double ray_margin) {
    const double longest = max_component(abs(ray.direction()));
    const Vec3d direction = ray.direction() * (1 / longest);
    const double length = std::sqrt(squared_length(direction));
    const Vec3d toward = direction * (1 / length);
    const Vec3d to_origin = ray.origin() - brick.place.center;
    start_ = dot(to_origin, toward);
    speed_ = longest * length;
    const Vec3d point = to_origin - toward * start_;
    const double far = max_component(abs(to_origin));
    for (int axis = 0; axis < 3; ++axis) {
      line_.point[axis] = static_cast<float>(point[axis]);
      line_.direction[axis] = static_cast<float>(toward[axis]);
    }
    // Along the brick the line's direction and its point are off by a few 2^-24 of the lengths, and by 2^-50 of the
    // way.
    line_.margin = static_cast<float>((cull_margin(brick) + ray_margin + 0x1p-46 * far +
                                       4 * double{kCullSlack} * (max_component(abs(point)) + 2 * brick.place.edge)) *
                                      (1 + 2 * double{kCullSlack}));
    line_.from = static_cast<float>(start_ - kEndSlack * std::abs(start_));
    end_at(std::numeric_limits<double>::infinity());
  }

  // Nothing beyond `limit`, in lengths of the direction, is asked for any more.
  void end_at(double limit) {
    const double end = start_ + limit * speed_;
    line_.to = static_cast<float>(std::clamp(end + kEndSlack * std::abs(end), -kFar, kFar));
  }
  const GridLine& line() const { return line_; }

 private:
  static constexpr double kEndSlack = 2 * double{kCullSlack};
  static constexpr double kFar = 0x1p120;

  GridLine line_;
  double start_, speed_;  // where it starts, by its distance from the point, and how far one of its lengths is
};

// What culls the values of a brick for a box, and for a ball.
class BoxCull {
 public:
  explicit BoxCull(const Aabbd& region) : region_(&region) {}
  auto operator()(const Brick& brick) const {
    return [&kernels = active_grid_kernels(), box = cull_box_of(brick, *region_)](
               const GridRows& rows, uint32_t* slots) { return kernels.cull_box(rows, box, slots); };
  }

 private:
  const Aabbd* region_;
};
class BallCull {
 public:
  explicit BallCull(const Balld& ball) : ball_(&ball) {}
  auto operator()(const Brick& brick) const {
    return [&kernels = active_grid_kernels(), ball = cull_ball_of(brick, *ball_)](
               const GridRows& rows, uint32_t* slots) { return kernels.cull_ball(rows, ball, slots); };
  }

 private:
  const Balld* ball_;
};

// The rows of cells, numbered within the brick, of its sorted block: those that hold values, and rows that follow on
// each other as one.
inline GridRows rows_of(const Brick& brick, const KeyRange& cells) {
  static_assert(GridRows::kMax == 1 << (2 * kBrickBits));
  const GridBlock& sorted = *brick.sorted;
  GridRows rows;
  rows.x = sorted.column(0), rows.y = sorted.column(1), rows.z = sorted.column(2), rows.reach = sorted.column(3);
  rows.gone = brick.gone_count == 0 ? nullptr : brick.gone.data();
  rows.count = 0;
  if (cells.empty()) return rows;
  constexpr uint32_t kRow = 1 << kBrickBits, kLayer = kRow << kBrickBits;
  const GridKey& lo = cells.lo;
  const auto x_cells = static_cast<uint32_t>(cells.hi.x - lo.x + 1),
             y_rows = static_cast<uint32_t>(cells.hi.y - lo.y + 1);
  const auto layers = static_cast<uint32_t>(cells.hi.z - lo.z + 1);
  const bool whole_rows = x_cells == kRow, whole_layers = whole_rows && y_rows == kRow;
  const uint32_t runs_a_layer = whole_rows ? 1 : y_rows, runs = whole_layers ? 1 : runs_a_layer * layers;
  const uint32_t run_cells = whole_layers ? layers * kLayer : whole_rows ? y_rows * kRow : x_cells;
  auto cell = static_cast<uint32_t>(lo.z << (2 * kBrickBits) | lo.y << kBrickBits | lo.x);
  uint32_t left = runs_a_layer;
  for (uint32_t run = 0; run < runs; ++run) {
    const uint32_t begin = sorted.offsets()[cell], end = sorted.offsets()[cell + run_cells];
    rows.begin[rows.count] = begin;
    rows.end[rows.count] = end;
    rows.count += begin != end ? 1 : 0;
    cell += kRow;
    if (--left == 0) {
      left = runs_a_layer;
      cell += kLayer - runs_a_layer * kRow;
    }
  }
  if (planted(PlantedBug::kDropCell)) rows.end[0] = rows.begin[0];
  return rows;
}

// fn(rows) for these, or parts of them of at most kMaxValues; false once fn() was.
template <class Fn>
bool for_each_part(const GridRows& rows, const Fn& fn) {
  uint32_t values = 0;
  for (uint32_t row = 0; row < rows.count; ++row) values += rows.end[row] - rows.begin[row];
  if (values <= GridRows::kMaxValues) return values == 0 || fn(rows);
  GridRows part = rows;
  part.count = 1;
  for (uint32_t row = 0; row < rows.count; ++row) {
    for (part.begin[0] = rows.begin[row]; part.begin[0] < rows.end[row]; part.begin[0] = part.end[0]) {
      part.end[0] = std::min(rows.end[row], part.begin[0] + GridRows::kMaxValues);
      if (!fn(part)) return false;
    }
  }
  return true;
}

// Those values of the rows that cull(rows, slots) keeps; false once visit() was.
template <class Cull, class Visit>
bool scan_rows(const GridBlock& block, uint32_t brick, const GridRows& all, Work& work, const Cull& cull,
               const Visit& visit) {
  return for_each_part(all, [&](const GridRows& rows) {
    uint32_t slots[GridRows::kMaxValues + GridBlock::kLanes];
    const uint32_t kept = cull(rows, slots);
    work.cells += rows.count;
    for (uint32_t i = 0; i < kept; ++i) block.prefetch_entry(slots[i]);
    for (uint32_t i = 0; i < kept; ++i) {
      ++work.tests;
      if (!visit(GridRef(block, slots[i], brick))) return false;
    }
    return true;
  });
}

// Those values of `cells`, which are numbered within the brick, that cull(rows, slots) keeps; false once visit() was.
template <class Cull, class Visit>
bool scan_cells(const Brick& brick, const KeyRange& cells, Work& work, const Cull& cull, const Visit& visit) {
  return scan_rows(*brick.sorted, brick.number, rows_of(brick, cells), work, cull, visit);
}

// The same for the values that came or moved lately, wherever in the brick they are.
template <class Cull, class Visit>
bool scan_recent(const Brick& brick, Work& work, const Cull& cull, const Visit& visit) {
  if (brick.recent_count == 0) return true;
  const GridBlock& recent = *brick.recent;
  const uint32_t whole = brick.recent_count / GridBlock::kLanes * GridBlock::kLanes;
  const GridRows vectors = {
      recent.column(0), recent.column(1), recent.column(2), recent.column(3), brick.recent_gone.data(), 1, {0},
      {whole}};
  if (!scan_rows(recent, brick.number, vectors, work, cull, visit)) return false;
  if (whole == brick.recent_count) return true;
  // Copied: the rest of their vector belongs to the writer.
  const uint32_t rest = brick.recent_count - whole;
  float columns[4][GridBlock::kLanes] = {};
  for (int number = 0; number < 4; ++number) std::copy_n(recent.column(number) + whole, rest, columns[number]);
  const uint64_t gone[2] = {brick.recent_gone[whole / 64] >> (whole % 64), 0};
  const GridRows rows = {columns[0], columns[1], columns[2], columns[3], gone, 1, {0}, {rest}};
  uint32_t slots[2 * GridBlock::kLanes];
  const uint32_t kept = cull(rows, slots);
  for (uint32_t i = 0; i < kept; ++i) {
    ++work.tests;
    if (!visit(GridRef(recent, whole + slots[i], brick.number))) return false;
  }
  return true;
}

// Each value, until visit() is false, which is then returned.
template <class Visit>
bool for_each_value(const Brick& brick, const Visit& visit) {
  for (uint32_t slot = 0; slot < brick.sorted->count(); ++slot)
    if (!brick.is_gone(slot) && !visit(GridRef(*brick.sorted, slot, brick.number))) return false;
  for (uint32_t slot = 0; slot < brick.recent_count; ++slot)
    if (!brick.is_recent_gone(slot) && !visit(GridRef(*brick.recent, slot, brick.number))) return false;
  return true;
}

}  // namespace internal
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_SCAN_H_
