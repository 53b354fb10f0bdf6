// Tests of eight boxes of a tree, or of the boxes of eight triangles, against a half line that is parallel to an axis.
// The half line meets a box if they have a point in common and the box does not begin beyond the end of the search. All
// sides belong to the box, and the start belongs to the half line. The tests are exact, so they need no pads: see
// half_line_floats.h. Immutable; any thread.
#ifndef LOCUS_CORE_INDEX_BVH_HALF_LINE_BOXES_H_
#define LOCUS_CORE_INDEX_BVH_HALF_LINE_BOXES_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/float_step.h"
#include "core/geometry/point_in_mesh.h"
#include "core/index/bvh/half_line_floats.h"
#include "core/index/bvh/triangle_tree.h"

namespace locus {

class HalfLineBoxes {
 public:
  HalfLineBoxes(const Vec3d& point, HalfLine line) {
    LOCUS_DCHECK(0 <= line.axis && line.axis < 3);
    const double along = line.descending ? -point[line.axis] : point[line.axis];
    floats_.axis = line.axis;
    floats_.way = line.descending ? -1.0f : 1.0f;
    floats_.along_low = rounded_down(along);
    floats_.along_high = rounded_up(along);
    floats_.along_end = std::numeric_limits<float>::infinity();
    if (planted(PlantedBug::kHalfLineStart)) floats_.along_high = next_above(floats_.along_high);
    double pad = 0;
    for (int i = 0; i < 2; ++i) {
      const double across = point[(line.axis + 1 + i) % 3];
      floats_.low[i] = rounded_down(across);
      floats_.high[i] = rounded_up(across);
      floats_.rounded[i] = static_cast<float>(across);
      pad = std::max(pad, std::abs(across - double{floats_.rounded[i]}));
    }
    floats_.pad = rounded_up(pad);
  }

  // Makes a half line whose search ends at the coordinate `end` on line.axis: the half line does not meet boxes that
  // begin beyond `end`. `end` may be infinite.
  HalfLineBoxes(const Vec3d& point, HalfLine line, float end) : HalfLineBoxes(point, line) {
    floats_.along_end = end * floats_.way;
  }

  const HalfLineFloats& floats() const { return floats_; }

  // Returns a mask with one bit for each of eight boxes, set if the half line meets the box. The boxes are laid out as
  // in TriangleNode::bounds. The bits of unused slots are 0.
  uint32_t boxes_met(const float (&bounds)[6][kTreeWidth]) const {
    const int axis = floats_.axis, first = (axis + 1) % 3, second = (axis + 2) % 3;
    const float(&begins)[kTreeWidth] = bounds[floats_.way > 0 ? axis : axis + 3];
    const float(&ends)[kTreeWidth] = bounds[floats_.way > 0 ? axis + 3 : axis];
    uint32_t met = 0;
    for (int i = 0; i < kTreeWidth; ++i) {
      const int is_met = (ends[i] * floats_.way >= floats_.along_high) &
                         (begins[i] * floats_.way <= floats_.along_end) & (bounds[first][i] <= floats_.low[0]) &
                         (bounds[first + 3][i] >= floats_.high[0]) & (bounds[second][i] <= floats_.low[1]) &
                         (bounds[second + 3][i] >= floats_.high[1]);
      met |= static_cast<uint32_t>(is_met) << i;
    }
    return met;
  }

  // Returns the mask of boxes_met() for the boxes around eight triangles, laid out as in TriangleBlock::vertices.
  uint32_t triangles_met(const float (&v)[9][kTreeWidth]) const {
    float bounds[6][kTreeWidth];
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < kTreeWidth; ++i) {
        bounds[axis][i] = std::min(std::min(v[axis][i], v[axis + 3][i]), v[axis + 6][i]);
        bounds[axis + 3][i] = std::max(std::max(v[axis][i], v[axis + 3][i]), v[axis + 6][i]);
      }
    }
    return boxes_met(bounds);
  }

 private:
  // Return the greatest float that is at most `value`, and the least float that is at least `value`.
  static float rounded_down(double value) { return -rounded_up(-value); }
  static float rounded_up(double value) {
    const auto nearest = static_cast<float>(value);
    if (planted(PlantedBug::kHalfLineRounding)) return nearest;
    return double{nearest} < value ? next_above(nearest) : nearest;
  }

  HalfLineFloats floats_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_HALF_LINE_BOXES_H_
