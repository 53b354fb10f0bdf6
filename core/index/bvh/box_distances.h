// Squared distances from a point to eight boxes, or to the boxes of eight triangles, computed in float for culling. If
// a computed float distance exceeds limit(x), then the exact squared distance exceeds x, so culling never drops a box
// within the limit x. The loops over eight adjacent floats are compiled to vector instructions. Immutable; any thread.
#ifndef LOCUS_CORE_INDEX_BVH_BOX_DISTANCES_H_
#define LOCUS_CORE_INDEX_BVH_BOX_DISTANCES_H_

#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/vec3.h"
#include "core/index/bvh/triangle_tree.h"

namespace locus {

class BoxDistances {
 public:
  explicit BoxDistances(const Vec3d& point)
      : x_(static_cast<float>(point.x)),
        y_(static_cast<float>(point.y)),
        z_(static_cast<float>(point.z)),
        // Rounding the point to float moves it by less than 2^-24 sqrt(3) times its largest coordinate.
        pad_(planted(PlantedBug::kNearestTreePad) ? 0 : 0x1p-23 * max_component(abs(point))) {}

  // Returns the limit with which float squared distances must be compared if `squared` is the limit of the exact
  // squared distances. The returned limit exceeds `squared` by the error of the float values: rounding of gaps, squares
  // and sums changes a distance by less than 2^-22 of its value.
  float limit(double squared) const {
    LOCUS_DCHECK(!std::isnan(squared));
    const double raised = std::sqrt(squared) * (1 + kRounding) + pad_;
    const double result = raised * raised * (1 + kRounding);
    // Smaller limits are raised to kMin, because smaller squares lose precision in float (denormal range).
    constexpr double kMin = 0x1p-100, kMax = std::numeric_limits<float>::max();
    return result > kMax ? std::numeric_limits<float>::infinity() : static_cast<float>(std::max(result, kMin));
  }

  // Writes the squared distance from the point to each of eight boxes, laid out as in TriangleNode::bounds.
  void to_boxes(const float (&bounds)[6][kTreeWidth], float (&distances)[kTreeWidth]) const {
    for (int i = 0; i < kTreeWidth; ++i)
      distances[i] = squared(gap(x_, bounds[0][i], bounds[3][i]), gap(y_, bounds[1][i], bounds[4][i]),
                             gap(z_, bounds[2][i], bounds[5][i]));
  }

  // Writes the squared distance from the point to the box around each of eight triangles, laid out as in
  // TriangleBlock::vertices.
  void to_triangles(const float (&v)[9][kTreeWidth], float (&distances)[kTreeWidth]) const {
    for (int i = 0; i < kTreeWidth; ++i)
      distances[i] = squared(gap(x_, min_of_three(v[0][i], v[3][i], v[6][i]), max_of_three(v[0][i], v[3][i], v[6][i])),
                             gap(y_, min_of_three(v[1][i], v[4][i], v[7][i]), max_of_three(v[1][i], v[4][i], v[7][i])),
                             gap(z_, min_of_three(v[2][i], v[5][i], v[8][i]), max_of_three(v[2][i], v[5][i], v[8][i])));
  }

 private:
  static constexpr double kRounding = 0x1p-21;

  static float minimum(float a, float b) { return a < b ? a : b; }
  static float maximum(float a, float b) { return a > b ? a : b; }
  static float min_of_three(float a, float b, float c) { return minimum(minimum(a, b), c); }
  static float max_of_three(float a, float b, float c) { return maximum(maximum(a, b), c); }
  static float gap(float at, float low, float high) { return maximum(maximum(low - at, at - high), 0.0f); }
  static float squared(float x, float y, float z) { return x * x + y * y + z * z; }

  float x_, y_, z_;
  double pad_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BOX_DISTANCES_H_
