// Ray in double, padded so that a structure whose nodes are not boxes culls no value that the slab test accepts. Plain
// data and pure functions; any thread.
//
// The slab test (core/geometry/ray.h) accepts a box if it finds a t with near <= t <= far. Then the point of the ray at
// t is within w = m + e of the box on each axis. Here m is SlabRay::margin(). The error e covers at most eight
// roundings in the scalar type of a number up to size = max |origin| + magnitude, and the replacement of small
// components of the direction. So the box contains a point whose distance from the point of the ray is at most sqrt(3)
// * (m + e). pad() is at least this distance, plus the rounding errors of sums of a few products in double of numbers
// up to 3 * size.
#ifndef LOCUS_CORE_INDEX_PADDED_RAY_H_
#define LOCUS_CORE_INDEX_PADDED_RAY_H_

#include <algorithm>
#include <cmath>
#include <concepts>

#include "core/base/planted_bug.h"
#include "core/geometry/ray.h"

namespace locus {

// Range of distances along a ray. Empty if begin > end.
struct RaySpan {
  double begin, end;

  bool empty() const { return !(begin <= end); }
};

class PaddedRay {
 public:
  // `magnitude` is an upper bound of the |coordinates| of all boxes of the structure.
  template <std::floating_point S>
  PaddedRay(const SlabRay<S>& slabs, S magnitude) : origin_(to_double(slabs.origin())) {
    const Vec3d direction = to_double(slabs.direction());
    const double scale = max_component(abs(direction));
    const Vec3d scaled = {direction.x / scale, direction.y / scale, direction.z / scale};
    const double length = std::sqrt(squared_length(scaled));
    unit_ = {scaled.x / length, scaled.y / length, scaled.z / length};
    length_ = scale * length;
    constexpr double kRounding = std::same_as<S, double> ? 0x1p-46 : 0x1p-19;
    const double size = max_component(abs(origin_)) + double{magnitude};
    pad_ = 2 * double{slabs.margin(magnitude)} + kRounding * size;
    if (planted(PlantedBug::kPaddedRayThin)) pad_ = 0;
  }

  const Vec3d& origin() const { return origin_; }
  // Returns the unit vector along the ray.
  const Vec3d& unit() const { return unit_; }
  double pad() const { return pad_; }

  // Returns an upper bound of the distances along the ray at which boxes with a near value of at most `limit` (see
  // RayVisitor::limit()) can be reached: the part of an accepted box that begins at t < 0 continues to t = 0.
  double reach(double limit) const {
    const double distance = limit * length_;
    return std::max(distance + std::abs(distance) * 0x1p-50, 0.0);
  }

 private:
  Vec3d origin_, unit_;
  double length_;  // length of the direction of the slab test
  double pad_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_PADDED_RAY_H_
