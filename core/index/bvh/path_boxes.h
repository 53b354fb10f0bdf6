// The t at which a moving box begins to touch each of eight boxes of a tree, or the boxes of eight triangles. Computed
// in float, for culling. The moving box is a ray with an extent on each axis: a box of the tree is grown by the extent
// and by a pad, as in the slab test of core/geometry/ray.h. Every rounding step is monotone in the box, and the pad is
// the same for all boxes of one tree, so no box is culled if entry() accepts a box inside it. The loops over eight
// adjacent floats are compiled to vector instructions. Immutable; any thread.
#ifndef LOCUS_CORE_INDEX_BVH_PATH_BOXES_H_
#define LOCUS_CORE_INDEX_BVH_PATH_BOXES_H_

#include <cmath>
#include <limits>
#include <optional>

#include "core/base/check.h"
#include "core/geometry/ray.h"
#include "core/index/bvh/triangle_tree.h"

namespace locus {

class PathBoxes {
 public:
  // Value that to_boxes() and to_triangles() write for a box that the path misses.
  static constexpr float kMissed = std::numeric_limits<float>::infinity();

  // Makes the path of a box of half extents `extent` around `origin` + t * `direction`. The largest |component| of
  // `direction` should be near 1. `magnitude` is the largest |coordinate| of the tree's boxes.
  PathBoxes(Vec3d origin, Vec3d direction, Vec3d extent, float magnitude) {
    const double longest = max_component(abs(direction));
    LOCUS_DCHECK_GT(longest, 0.0);
    const double pad = kTrianglePad * (max_component(abs(origin)) + max_component(extent) + double{magnitude});
    for (int axis = 0; axis < 3; ++axis) {
      const double smallest = 1e-18 * longest;
      const double d = direction[axis];
      const double reciprocal = 1 / (std::abs(d) < smallest ? std::copysign(smallest, d) : d);
      const double center = origin[axis] * reciprocal, reach = (extent[axis] + pad) * std::abs(reciprocal);
      reciprocal_[axis] = static_cast<float>(reciprocal);
      enter_[axis] = static_cast<float>(center + reach);
      leave_[axis] = static_cast<float>(center - reach);
      low_[axis] = reciprocal < 0 ? axis + 3 : axis;
      high_[axis] = reciprocal < 0 ? axis : axis + 3;
    }
  }

  // Returns the t at which the path enters the grown box; t is negative if the path starts inside. Returns nullopt if
  // the path misses the box or leaves it before t = 0.
  std::optional<float> entry(const Aabbf& box) const {
    const float sides[6] = {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z};
    const float near =
        near_of(sides[low_[0]], sides[low_[1]], sides[low_[2]], sides[high_[0]], sides[high_[1]], sides[high_[2]]);
    if (near == kMissed) return std::nullopt;
    return near;
  }

  // Writes the result of entry() for each of eight boxes, laid out as in TriangleNode::bounds; kMissed for nullopt.
  void to_boxes(const float (&bounds)[6][kTreeWidth], float (&nears)[kTreeWidth]) const {
    const float(&lx)[kTreeWidth] = bounds[low_[0]], (&ly)[kTreeWidth] = bounds[low_[1]];
    const float(&lz)[kTreeWidth] = bounds[low_[2]], (&hx)[kTreeWidth] = bounds[high_[0]];
    const float(&hy)[kTreeWidth] = bounds[high_[1]], (&hz)[kTreeWidth] = bounds[high_[2]];
    for (int i = 0; i < kTreeWidth; ++i) nears[i] = near_of(lx[i], ly[i], lz[i], hx[i], hy[i], hz[i]);
  }

  // Writes the result of entry() for the box around each of eight triangles, laid out as in TriangleBlock::vertices;
  // kMissed for nullopt.
  void to_triangles(const float (&v)[9][kTreeWidth], float (&nears)[kTreeWidth]) const {
    float bounds[6][kTreeWidth];
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < kTreeWidth; ++i) {
        bounds[axis][i] = minimum(minimum(v[axis][i], v[axis + 3][i]), v[axis + 6][i]);
        bounds[axis + 3][i] = maximum(maximum(v[axis][i], v[axis + 3][i]), v[axis + 6][i]);
      }
    }
    to_boxes(bounds, nears);
  }

 private:
  static float minimum(float a, float b) { return a < b ? a : b; }
  static float maximum(float a, float b) { return a > b ? a : b; }
  // Returns the t at which the path enters a box, or kMissed. The arguments are the sides at which the path enters the
  // box (`lx` ...) and leaves it (`hx` ...). If coordinates overflow to NaN, the comparisons are false, so the box is
  // not culled.
  float near_of(float lx, float ly, float lz, float hx, float hy, float hz) const {
    const float near = maximum(maximum(lx * reciprocal_[0] - enter_[0], ly * reciprocal_[1] - enter_[1]),
                               lz * reciprocal_[2] - enter_[2]);
    const float far = minimum(minimum(hx * reciprocal_[0] - leave_[0], hy * reciprocal_[1] - leave_[1]),
                              hz * reciprocal_[2] - leave_[2]);
    // NOLINTNEXTLINE(bugprone-narrowing-conversions): clang-tidy 14 takes infinity for a double
    return ((near > far) | (far < 0)) ? kMissed : near;
  }

  float reciprocal_[3];
  float enter_[3], leave_[3];
  int low_[3], high_[3];  // rows of TriangleNode::bounds with the sides at which the path enters and leaves
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_PATH_BOXES_H_
