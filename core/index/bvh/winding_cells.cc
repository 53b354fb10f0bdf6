#include "core/index/bvh/winding_cells.h"

#include <cmath>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/bvh/half_line_boxes.h"

namespace locus {
namespace {

// Visitor that sums the crossings of a half line.
struct CrossingSum {
  bool visit(const Triangle& triangle) {
    winding += crossing(point, triangle, line).winding;
    return true;
  }
  const Vec3d point;
  const HalfLine line;
  int64_t winding = 0;
};

// Returns the winding number of a closed mesh around a point that is not on its surface.
int64_t winding_around(const TriangleBvh& tree, const Vec3d& point) {
  const HalfLine line = tree.cheapest_half_line(point);
  CrossingSum sum{point, line};
  Work work;
  tree.visit_half_line(HalfLineBoxes(point, line), sum, work);
  return sum.winding;
}

}  // namespace

WindingCells WindingCells::build(const TriangleBvh& tree) {
  WindingCells cells;
  if (tree.size() == 0) return cells;
  cells.divide(tree.bounds(), tree.size());
  cells.mark(tree);
  cells.set_windings(tree);
  cells.set_ways();
  LOCUS_DCHECK_CALL(cells.check_invariants(tree));
  return cells;
}

WindingWay WindingCells::way_from(const TriangleBvh& tree, const Vec3d& point) const {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_outside =
        point[axis] < double{tree.bounds().min[axis]} || point[axis] > double{tree.bounds().max[axis]};
    if (is_outside) return {true, 0, {}, 0};
    cell[axis] = axes_[axis].cell(point[axis]);
  }
  const uint8_t value = cells_.empty() ? kNoWay : cells_[index_of(cell)];
  if (is_clear(value)) return {true, value + kMinWinding, {}, 0};
  if (value == kNoWay) return WindingWay::out(tree.cheapest_half_line(point));
  const int direction = (value - kFirstWay) / kMaxSteps, steps = (value - kFirstWay) % kMaxSteps + 1;
  WindingWay way = WindingWay::out({direction % 3, direction >= 3});
  const Axis& axis = axes_[way.line.axis];
  const uint32_t start = cell[way.line.axis];
  // If the way leads out of the bounds, `to` is at least axis.count: below the first cell, the unsigned `to` wraps
  // around.
  const uint32_t to = start + static_cast<uint32_t>(way.line.descending ? -steps : steps);
  if (to >= axis.count) return way;
  cell[way.line.axis] = to;
  const uint8_t end = cells_[index_of(cell)];
  LOCUS_DCHECK(is_clear(end));
  way.winding = end + kMinWinding;
  way.end = axis.inside[planted(PlantedBug::kWayShort) ? start : to];
  return way;
}

size_t WindingCells::bytes() const {
  size_t bytes = cells_.capacity();
  for (const Axis& axis : axes_) bytes += axis.inside.capacity() * sizeof(float);
  return bytes;
}

Vec3d WindingCells::inside(uint32_t index) const {
  Vec3d point;
  for (int axis = 0; axis < 3; ++axis) point[axis] = double{axes_[axis].inside[coordinate_of(index, axis)]};
  return point;
}

void WindingCells::divide(const Aabbf& bounds, size_t triangles) {
  const Vec3d extent = to_double(bounds.max) - to_double(bounds.min);
  const double most = std::min(double{kMaxCells}, kCellsPerTriangle * static_cast<double>(triangles));
  Cell counts = {1, 1, 1};
  // Decreases the size of a cell until there would be more than `most` cells.
  constexpr double kShrink = 0.9, kMinPart = 1.0 / kMaxCellsPerAxis;
  for (double part = 1; part > kMinPart; part *= kShrink) {
    const double size = part * max_component(extent);
    Cell smaller;
    for (int axis = 0; axis < 3; ++axis)
      smaller[axis] = extent[axis] > size ? static_cast<uint32_t>(extent[axis] / size) : 1;
    if (static_cast<double>(smaller[0]) * smaller[1] * smaller[2] > most) break;
    counts = smaller;
  }
  uint32_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    axes_[axis] = divided(double{bounds.min[axis]}, double{bounds.max[axis]}, counts[axis]);
    axes_[axis].stride = stride;
    stride *= axes_[axis].count;
  }
}

WindingCells::Axis WindingCells::divided(double low, double high, uint32_t count) {
  Axis axis;
  axis.low = low;
  axis.count = count;
  axis.size = (high - low) / count;
  axis.cells_a_unit = count > 1 ? count / (high - low) : 0;
  axis.inside.resize(count);
  for (uint32_t cell = 0; cell < count; ++cell) {
    axis.inside[cell] =
        count > 1 ? static_cast<float>(low + (cell + 0.5) / axis.cells_a_unit) : static_cast<float>(low);
    // An axis is not divided if a cell would be too small to contain a float, because a way could not end in this cell.
    if (axis.cell(double{axis.inside[cell]}) != cell) return divided(low, high, 1);
  }
  return axis;
}

void WindingCells::mark(const TriangleBvh& tree) {
  // Each triangle adds 1 or -1 at the eight corners of its range of cells, so that the prefix sums along all three axes
  // are the numbers of triangles in the cells.
  std::array<uint32_t, 3> strides;
  uint32_t size = 1;
  for (int axis = 0; axis < 3; ++axis) {
    strides[axis] = size;
    size *= axes_[axis].count + 1;
  }
  std::vector<int32_t> sums(size);
  tree.for_each([&](const Triangle& triangle) {
    const Aabbf bounds = bounds_of(triangle);
    uint32_t from[3], behind[3];
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = axes_[axis].cell(double{bounds.min[axis]}) * strides[axis];
      behind[axis] = (axes_[axis].cell(double{bounds.max[axis]}) + 1) * strides[axis];
      if (planted(PlantedBug::kCellAtMax))
        behind[axis] = std::max(behind[axis] - strides[axis], from[axis] + strides[axis]);
    }
    for (int corner = 0; corner < 8; ++corner) {
      const uint32_t at = ((corner & 1) != 0 ? behind : from)[0] + ((corner & 2) != 0 ? behind : from)[1] +
                          ((corner & 4) != 0 ? behind : from)[2];
      sums[at] += __builtin_popcount(static_cast<unsigned>(corner)) % 2 == 0 ? 1 : -1;
    }
  });
  for (int axis = 0; axis < 3; ++axis) {
    const uint32_t stride = strides[axis], length = stride * (axes_[axis].count + 1);
    for (uint32_t first = 0; first < size; first += length)
      for (uint32_t at = first + stride; at < first + length; ++at) sums[at] += sums[at - stride];
  }
  cells_.reserve(this->size());
  for (uint32_t z = 0; z < axes_[2].count; ++z)
    for (uint32_t y = 0; y < axes_[1].count; ++y)
      for (uint32_t x = 0; x < axes_[0].count; ++x)
        cells_.push_back(sums[x + y * strides[1] + z * strides[2]] == 0 ? kUnset : kNoWay);
}

void WindingCells::set_windings(const TriangleBvh& tree) {
  uint32_t sets = 0;
  for (uint32_t index = 0; index < cells_.size(); ++index) {
    if (cells_[index] != kUnset) continue;
    const int64_t winding = sets++ < kMaxSets ? winding_around(tree, inside(index)) : kMaxWinding + 1;
    const bool is_stored = kMinWinding <= winding && winding <= kMaxWinding;
    fill(index, is_stored ? static_cast<uint8_t>(winding - kMinWinding) : kNoWay);
  }
}

void WindingCells::fill(uint32_t first, uint8_t value) {
  std::vector<uint32_t> waiting = {first};
  cells_[first] = value;
  while (!waiting.empty()) {
    const uint32_t index = waiting.back();
    waiting.pop_back();
    for (int axis = 0; axis < 3; ++axis) {
      const uint32_t at = coordinate_of(index, axis);
      const uint32_t stride = axes_[axis].stride;
      const auto reach = [&](uint32_t beside) {
        if (cells_[beside] != kUnset) return;
        cells_[beside] = value;
        waiting.push_back(beside);
      };
      if (at > 0) reach(index - stride);
      if (at + 1 < axes_[axis].count) reach(index + stride);
    }
  }
}

void WindingCells::set_ways() {
  std::vector<float> lengths(cells_.size(), std::numeric_limits<float>::infinity());
  for (int direction = 0; direction < 6; ++direction) {
    const Axis &axis = axes_[direction % 3], &second = axes_[(direction + 1) % 3], &third = axes_[(direction + 2) % 3];
    const bool descending = direction >= 3;
    for (uint32_t row = 0; row < second.count * third.count; ++row) {
      const uint32_t start = row % second.count * second.stride + row / second.count * third.stride;
      // Walks opposite to `direction`, beginning at the side of the bounds to which `direction` leads.
      int steps = 0;
      for (uint32_t k = 0; k < axis.count; ++k) {
        const uint32_t index = start + (descending ? k : axis.count - 1 - k) * axis.stride;
        if (is_clear(cells_[index])) {
          steps = 0;
          continue;
        }
        const auto length = static_cast<float>(++steps * axis.size);
        if (steps > kMaxSteps || length >= lengths[index]) continue;
        lengths[index] = length;
        cells_[index] = static_cast<uint8_t>(kFirstWay + direction * kMaxSteps + steps - 1);
      }
    }
  }
}

void WindingCells::check_invariants(const TriangleBvh& tree) const {
  const size_t every = cells_.size() / 64 + 1;
  for (uint32_t index = 0; index < cells_.size(); ++index) {
    if (index % every != 0 && is_clear(cells_[index])) continue;
    const WindingWay way = way_from(tree, inside(index));
    LOCUS_DCHECK_EQ(way.is_known, is_clear(cells_[index]));
    if (way.is_known) LOCUS_DCHECK_EQ(int64_t{way.winding}, winding_around(tree, inside(index)));
    LOCUS_DCHECK(kMinWinding <= way.winding && way.winding <= kMaxWinding);
  }
}

}  // namespace locus
