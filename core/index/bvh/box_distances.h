// Squared distances from a point to eight boxes, or to the boxes of eight triangles, computed in float for culling. If
// a distance exceeds limit(x) in float, then the exact distance exceeds x in double: culling never drops a wanted box.
// The loops over eight adjacent floats are compiled to vector instructions. Immutable; any thread.
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

  // Returns the limit in float for a limit of squared distances in double. The relative rounding error of gaps, squares
  // and sums is less than 2^-22 of the distance.
  float limit(double squared) const {
    LOCUS_DCHECK(!std::isnan(squared));
    const double raised = std::sqrt(squared) * (1 + kRounding) + pad_;
    const double result = raised * raised * (1 + kRounding);
    // Squares below this lose precision in float (denormal range).
    constexpr double kMin = 0x1p-100, kMax = std::numeric_limits<float>::max();
    return result > kMax ? std::numeric_limits<float>::infinity() : static_cast<float>(std::max(result, kMin));
  }

  // Writes the squared distance to each of eight boxes.
  void to_boxes(const float (&bounds)[6][kTreeWidth], float (&distances)[kTreeWidth]) const {
    for (int i = 0; i < kTreeWidth; ++i)
      distances[i] = squared(gap(x_, bounds[0][i], bounds[3][i]), gap(y_, bounds[1][i], bounds[4][i]),
                             gap(z_, bounds[2][i], bounds[5][i]));
  }

  // Writes the squared distance to the box of each of eight triangles.
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
