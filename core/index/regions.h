// Regions: the culling half of ball and box queries, for the scalar type of an index. A region knows its axis-aligned
// bounds and tells which boxes it reaches; what it wants of a value is left to visitors. Immutable; cheap to copy.
#ifndef LOCUS_CORE_INDEX_REGIONS_H_
#define LOCUS_CORE_INDEX_REGIONS_H_

#include <cmath>
#include <concepts>
#include <limits>

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"

namespace locus {

namespace internal {
constexpr Vec3d widened(Vec3f a) { return to_double(a); }
constexpr Vec3d widened(Vec3d a) { return a; }
constexpr Aabbd widened(const Aabbf& a) { return to_double(a); }
constexpr Aabbd widened(const Aabbd& a) { return a; }

// The smallest box of S that contains `box`.
template <std::floating_point S>
Aabb<S> rounded_outward(const Aabbd& box) {
  constexpr S kInfinity = std::numeric_limits<S>::infinity();
  Aabb<S> result;
  for (int axis = 0; axis < 3; ++axis) {
    const S low = static_cast<S>(box.min[axis]), high = static_cast<S>(box.max[axis]);
    result.min[axis] = double{low} > box.min[axis] ? std::nextafter(low, -kInfinity) : low;
    result.max[axis] = double{high} < box.max[axis] ? std::nextafter(high, kInfinity) : high;
  }
  return result;
}
}  // namespace internal

// What a ball reaches: boxes whose squared distance from the centre, in double, is at most the squared radius. Every
// step rounds monotonically, so the region reaches every superset of a box that it reaches.
template <std::floating_point S>
class BallRegion {
 public:
  explicit BallRegion(const Ball<S>& ball)
      : center_(internal::widened(ball.center)), squared_radius_(double{ball.radius} * double{ball.radius}) {
    // The squared distance may round down to a touch where centre plus radius rounds short of the box, or vanish.
    const double radius = double{ball.radius};
    const double margin = 0x1p-50 * (max_component(abs(center_)) + radius) + 0x1p-500;
    bounds_ = internal::rounded_outward<S>(grown(Aabbd{center_, center_}, radius + margin));
  }

  const Aabb<S>& bounds() const { return bounds_; }
  bool overlaps(const Aabb<S>& box) const {
    return squared_distance(center_, internal::widened(box)) <= squared_radius_;
  }

 private:
  Vec3d center_;
  double squared_radius_;
  Aabb<S> bounds_;
};

// What a box reaches: boxes that overlap its axis-aligned bounds. Exact comparisons.
template <std::floating_point S>
class BoxRegion {
 public:
  explicit BoxRegion(const Obb<S>& box) : exact_(bounds_of(box)), bounds_(internal::rounded_outward<S>(exact_)) {}

  const Aabb<S>& bounds() const { return bounds_; }
  bool overlaps(const Aabb<S>& box) const { return locus::overlaps(exact_, internal::widened(box)); }

 private:
  Aabbd exact_;
  Aabb<S> bounds_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_REGIONS_H_
