// Functions that scan the values of one brick, or of some of its cells. Float kernels test eight values at a time and
// drop the values that cannot satisfy the query. The remaining values are passed to a visitor. Plain functions; any
// thread.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_SCAN_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_SCAN_H_

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/ball.h"
#include "core/geometry/ray.h"
#include "core/index/hash_grid/brick.h"
#include "core/index/hash_grid/kernels/grid_dispatch.h"
#include "core/index/hash_grid/slab_march.h"
#include "core/index/work.h"

namespace locus {

// Reference to a value of the grid, or an empty reference. A reference from a snapshot is valid as long as the snapshot
// exists; a reference from HashGrid is valid until the next change of the grid. Precondition of the accessors: the
// reference is not empty.
class GridRef {
 public:
  GridRef() = default;
  GridRef(const internal::GridBlock& block, uint32_t slot, uint32_t brick)
      : block_(&block), slot_(slot), brick_(brick) {
    LOCUS_DCHECK_LT(slot, block.count());
  }
  // Makes the reference of a slot that a kernel has written, marked with kInsideMark or not.
  static GridRef of_kernel(const internal::GridBlock& block, uint32_t slot, uint32_t brick) {
    return {block, slot & ~kInsideMark, brick | (slot & kInsideMark)};
  }

  explicit operator bool() const { return block_ != nullptr; }
  const GridEntry& entry() const { return block_->entry(slot_); }
  uint32_t handle() const { return block_->handle(slot_); }
  // Returns the extent of the value; see GridItem::reach.
  float reach() const { return block_->extent(slot_); }
  GridForm form() const { return block_->form(slot_); }
  GridItem item() const { return block_->item(slot_); }
  // Return the location of the value: its slot in its block, and the index of its brick.
  uint32_t slot() const { return slot_; }
  uint32_t brick() const { return brick_ & ~kInsideMark; }
  // Returns true if a search with Marks::kInside found the value, and its stored position is surely inside the box or
  // ball. The position of a value for which this function returns false may be inside as well.
  bool is_inside() const { return (brick_ & kInsideMark) != 0; }

 private:
  const internal::GridBlock* block_ = nullptr;
  uint32_t slot_ = 0;
  uint32_t brick_ = 0;  // with kInsideMark if is_inside()
};

namespace internal {

// Rounding allowance, relative to the magnitudes of coordinates and extents. The bounds of a value may reach beyond
// its extent, by up to 2^-40 of these magnitudes (see bounds_of() in core/geometry/shape.h). The factor 2^-38 covers
// this growth and the rounding of the sums in core/index/hash_grid.
inline constexpr double kBoundsGrowth = 0x1p-38;

inline constexpr KeyRange kAllCells{{0, 0, 0}, {3, 3, 3}};

// Returns the epsilon of the float tests that cull the values of `brick`. The epsilon covers two lengths: the rounding
// error of the float columns, and the length by which the bounds of a value may reach beyond its extent.
inline double cull_epsilon(const Brick& brick) {
  const double coordinate = brick.geometry.edge;  // twice the largest coordinate in the float columns
  const double extent = brick.max_extent;
  const double magnitude = max_component(abs(brick.geometry.center)) + brick.geometry.edge;
  return double{kCullEpsilon} * (coordinate + extent) + kBoundsGrowth * (magnitude + extent);
}

// Returns a box that contains all points whose distance from the position of a value of the brick is at most `extent`
// along each axis.
inline Aabbd box_around_values(const Brick& brick, double extent) {
  const BrickGeometry& geometry = brick.geometry;
  const double half = geometry.edge / 2 + extent;
  return grown(Aabbd{geometry.center, geometry.center},
               half + kBoundsGrowth * (max_component(abs(geometry.center)) + half));
}

// Returns `region` relative to the brick's centre, widened so that float culling keeps every value whose bounds overlap
// the region. With marks, the inner box is narrowed so that every position strictly inside it is inside the region, by
// a distance that exceeds the rounding errors of exact tests in double. `growth` is kBoundsGrowth times the magnitude
// of `region`.
inline GridBox cull_box_of(const Brick& brick, const Aabbd& region, Marks marks, double growth) {
  const double epsilon = cull_epsilon(brick);
  GridBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = region.min[axis] - brick.geometry.center[axis];
    const double high = region.max[axis] - brick.geometry.center[axis];
    const double low_margin = epsilon + std::abs(low) * double{kCullEpsilon};
    const double high_margin = epsilon + std::abs(high) * double{kCullEpsilon};
    box.low[axis] = static_cast<float>(low - low_margin);
    box.high[axis] = static_cast<float>(high + high_margin);
    if (marks == Marks::kNone) continue;
    if (planted(PlantedBug::kGridInsideMargin)) {
      box.inner_low[axis] = static_cast<float>(low);
      box.inner_high[axis] = static_cast<float>(high);
    } else {
      box.inner_low[axis] = static_cast<float>(low + low_margin + growth);
      box.inner_high[axis] = static_cast<float>(high - high_margin - growth);
    }
  }
  return box;
}

// Returns `ball` relative to the brick's centre, widened so that float culling keeps every value that shares a point
// with the ball. With marks, the inner ball is narrowed like the inner box of cull_box_of().
inline GridBall cull_ball_of(const Brick& brick, const Balld& ball, Marks marks) {
  const Vec3d center = ball.center - brick.geometry.center;
  const double magnitude = max_component(abs(center)) + brick.geometry.edge + ball.radius + brick.max_extent;
  GridBall cull;
  for (int axis = 0; axis < 3; ++axis) cull.center[axis] = static_cast<float>(center[axis]);
  if (planted(PlantedBug::kGridBallMargin))
    return {{cull.center[0], cull.center[1], cull.center[2]}, static_cast<float>(ball.radius)};
  // Rounding in the kernel's differences, squares and sums together changes the distance by less than 4 * 2^-24 of
  // itself. The widening and the narrowing below, in units of kCullEpsilon = 2^-20, are larger.
  const double epsilon = cull_epsilon(brick) + 4 * double{kCullEpsilon} * magnitude;
  cull.radius = static_cast<float>((ball.radius + epsilon) * (1 + 2 * double{kCullEpsilon}));
  if (marks == Marks::kNone) return cull;
  const double inner = planted(PlantedBug::kGridInsideMargin) ? ball.radius : ball.radius - epsilon;
  cull.inner_radius = static_cast<float>(std::max(inner, 0.0) * (1 - 2 * double{kCullEpsilon}));
  return cull;
}

// Ray relative to a brick's centre, as input of float culling: a line, given by its direction and its point nearest to
// the centre of the brick. This choice of the point keeps the float coordinates small.
class CullRay {
 public:
  // Makes the line of `ray` relative to `brick`. `ray_radius` is an upper bound of the distance by which the line may
  // miss a value's stored bounds although the ray hits the value: the rounding of the slab test and, for a query at a
  // past time, the distance of the value from its stored position.
  CullRay(const Brick& brick, const SlabRay<double>& ray, double ray_radius) {
    const double longest = max_component(abs(ray.direction()));
    const Vec3d direction = ray.direction() * (1 / longest);
    const double length = std::sqrt(squared_length(direction));
    const Vec3d toward = direction * (1 / length);
    const Vec3d to_origin = ray.origin() - brick.geometry.center;
    start_ = dot(to_origin, toward);
    speed_ = longest * length;
    const Vec3d point = to_origin - toward * start_;
    const double far = max_component(abs(to_origin));
    for (int axis = 0; axis < 3; ++axis) {
      line_.point[axis] = static_cast<float>(point[axis]);
      line_.direction[axis] = static_cast<float>(toward[axis]);
    }
    // Rounding of the line's direction and point moves the line within the brick. This displacement is a few times
    // 2^-24 of the coordinates of the point and of the brick's edge, plus 2^-50 of the distance to the origin of the
    // ray. The radius covers it.
    line_.radius =
        static_cast<float>((cull_epsilon(brick) + ray_radius + 0x1p-46 * far +
                            4 * double{kCullEpsilon} * (max_component(abs(point)) + 2 * brick.geometry.edge)) *
                           (1 + 2 * double{kCullEpsilon}));
    line_.from = static_cast<float>(start_ - kEndEpsilon * std::abs(start_));
    end_at(std::numeric_limits<double>::infinity());
  }

  // Ends the line at the ray parameter `limit`, in units of the ray's direction.
  void end_at(double limit) {
    const double end = start_ + limit * speed_;
    line_.to = static_cast<float>(std::clamp(end + kEndEpsilon * std::abs(end), -kFar, kFar));
  }
  const GridLine& line() const { return line_; }

 private:
  static constexpr double kEndEpsilon = 2 * double{kCullEpsilon};
  static constexpr double kFar = 0x1p120;

  GridLine line_;
  double start_;  // position of the ray's origin on the line: signed distance from the point of line_
  double speed_;  // length of the ray's direction
};

// Factories of culling functions for a box and for a ball. A factory, called with a brick, returns a function (rows,
// slots) that runs the kernel on values of the brick, with marks or without. The region or ball must outlive the
// factory and its functions.
class BoxCull {
 public:
  BoxCull(const Aabbd& region, Marks marks)
      : region_(&region), marks_(marks), growth_(marks == Marks::kNone ? 0 : kBoundsGrowth * magnitude(region)) {}
  auto operator()(const Brick& brick) const {
    const GridKernels& kernels = active_grid_kernels();
    return [run = marks_ == Marks::kNone ? kernels.cull_box : kernels.mark_box,
            box = cull_box_of(brick, *region_, marks_, growth_)](const GridRows& rows, uint32_t* slots) {
      return run(rows, box, slots);
    };
  }

 private:
  const Aabbd* region_;
  Marks marks_;
  double growth_;
};
class BallCull {
 public:
  BallCull(const Balld& ball, Marks marks) : ball_(&ball), marks_(marks) {}
  auto operator()(const Brick& brick) const {
    const GridKernels& kernels = active_grid_kernels();
    return [run = marks_ == Marks::kNone ? kernels.cull_ball : kernels.mark_ball,
            ball = cull_ball_of(brick, *ball_, marks_)](const GridRows& rows, uint32_t* slots) {
      return run(rows, ball, slots);
    };
  }

 private:
  const Balld* ball_;
  Marks marks_;
};

// Returns the rows of consecutive slots that hold the values of `cells` in the sorted block; `cells` is relative to the
// brick. Omits empty rows; cells that are adjacent in storage form one row.
inline GridRows rows_of(const Brick& brick, const KeyRange& cells) {
  static_assert(GridRows::kMax == 1 << (2 * kBrickBits));
  const GridBlock& sorted = *brick.sorted;
  GridRows rows;
  rows.x = sorted.column(0), rows.y = sorted.column(1), rows.z = sorted.column(2), rows.extent = sorted.column(3);
  rows.dead = brick.dead_count == 0 ? nullptr : brick.dead.data();
  rows.count = 0;
  if (cells.empty()) return rows;
  LOCUS_DCHECK(kAllCells.contains(cells.lo) && kAllCells.contains(cells.hi));
  constexpr uint32_t kRow = 1 << kBrickBits, kLayer = kRow << kBrickBits;
  const GridKey& lo = cells.lo;
  const auto x_cells = static_cast<uint32_t>(cells.hi.x - lo.x + 1),
             y_rows = static_cast<uint32_t>(cells.hi.y - lo.y + 1);
  const auto layers = static_cast<uint32_t>(cells.hi.z - lo.z + 1);
  const bool whole_rows = x_cells == kRow, whole_layers = whole_rows && y_rows == kRow;
  const uint32_t runs_per_layer = whole_rows ? 1 : y_rows, runs = whole_layers ? 1 : runs_per_layer * layers;
  const uint32_t run_cells = whole_layers ? layers * kLayer : whole_rows ? y_rows * kRow : x_cells;
  auto cell = static_cast<uint32_t>(lo.z << (2 * kBrickBits) | lo.y << kBrickBits | lo.x);
  uint32_t left = runs_per_layer;
  for (uint32_t run = 0; run < runs; ++run) {
    const uint32_t begin = sorted.offsets()[cell], end = sorted.offsets()[cell + run_cells];
    rows.begin[rows.count] = begin;
    rows.end[rows.count] = end;
    rows.count += begin != end ? 1 : 0;
    cell += kRow;
    if (--left == 0) {
      left = runs_per_layer;
      cell += kLayer - runs_per_layer * kRow;
    }
  }
  LOCUS_DCHECK_LE(rows.count, GridRows::kMax);
  if (planted(PlantedBug::kDropCell)) rows.end[0] = rows.begin[0];
  return rows;
}

// Calls fn(rows) if the rows hold at most kMaxValues values; otherwise splits the rows into parts of at most kMaxValues
// values and calls fn(part) for each part. Stops and returns false if a call of fn() returns false.
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

// Calls visit(GridRef) for the values in the rows `all` of `block` that the kernel cull(rows, slots) does not drop:
// cull() writes their slots, marked or not, and returns their number. `brick` is the index of the brick. Stops and
// returns false if visit() returns false.
template <class Cull, class Visit>
bool scan_rows(const GridBlock& block, uint32_t brick, const GridRows& all, Work& work, const Cull& cull,
               const Visit& visit) {
  return for_each_part(all, [&](const GridRows& rows) {
    uint32_t slots[GridRows::kMaxValues + GridBlock::kLanes];
    const uint32_t kept = cull(rows, slots);
    LOCUS_DCHECK_LE(kept, GridRows::kMaxValues);
    work.cells += rows.count;
    for (uint32_t i = 0; i < kept; ++i) block.prefetch_entry(slots[i] & ~kInsideMark);
    for (uint32_t i = 0; i < kept; ++i) {
      ++work.tests;
      if (!visit(GridRef::of_kernel(block, slots[i], brick))) return false;
    }
    return true;
  });
}

// Scans the values of the sorted block that lie in `cells`, which are relative to the brick. Culls and visits as
// scan_rows() does.
template <class Cull, class Visit>
bool scan_cells(const Brick& brick, const KeyRange& cells, Work& work, const Cull& cull, const Visit& visit) {
  return scan_rows(*brick.sorted, brick.index, rows_of(brick, cells), work, cull, visit);
}

// Scans all values of the brick's log, which is not ordered by cell. Culls and visits as scan_rows() does.
template <class Cull, class Visit>
bool scan_recent(const Brick& brick, Work& work, const Cull& cull, const Visit& visit) {
  if (brick.recent_count == 0) return true;
  const GridBlock& recent = *brick.recent;
  const uint32_t vector_end = brick.recent_count / GridBlock::kLanes * GridBlock::kLanes;
  const GridRows vectors = {
      recent.column(0), recent.column(1), recent.column(2), recent.column(3), brick.recent_dead.data(), 1, {0},
      {vector_end}};
  if (!scan_rows(recent, brick.index, vectors, work, cull, visit)) return false;
  if (vector_end == brick.recent_count) return true;
  // If the last vector is only partly filled, its values are copied, since the writer may append to its other lanes at
  // the same time.
  const uint32_t tail = brick.recent_count - vector_end;
  float columns[4][GridBlock::kLanes] = {};
  for (int column = 0; column < 4; ++column) std::copy_n(recent.column(column) + vector_end, tail, columns[column]);
  const uint64_t dead[2] = {brick.recent_dead[vector_end / 64] >> (vector_end % 64), 0};
  const GridRows rows = {columns[0], columns[1], columns[2], columns[3], dead, 1, {0}, {tail}};
  uint32_t slots[2 * GridBlock::kLanes];
  const uint32_t kept = cull(rows, slots);
  for (uint32_t i = 0; i < kept; ++i) {
    ++work.tests;
    if (!visit(GridRef::of_kernel(recent, vector_end + slots[i], brick.index))) return false;
  }
  return true;
}

// Calls visit(GridRef) for each live value of the brick. Stops and returns false if visit() returns false.
template <class Visit>
bool for_each_value(const Brick& brick, const Visit& visit) {
  for (uint32_t slot = 0; slot < brick.sorted->count(); ++slot)
    if (!brick.is_dead(slot) && !visit(GridRef(*brick.sorted, slot, brick.index))) return false;
  for (uint32_t slot = 0; slot < brick.recent_count; ++slot)
    if (!brick.is_recent_dead(slot) && !visit(GridRef(*brick.recent, slot, brick.index))) return false;
  return true;
}

}  // namespace internal
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_SCAN_H_
