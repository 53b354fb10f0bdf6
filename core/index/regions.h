// Regions: the culling tests of ball, box and capsule queries, in the scalar type S of an index. A region has
// axis-aligned bounds and a test of overlap with boxes; the visitors apply the exact tests to values. Regions are
// immutable and cheap to copy; any number of threads may use the same region.
#ifndef LOCUS_CORE_INDEX_REGIONS_H_
#define LOCUS_CORE_INDEX_REGIONS_H_

#include <cmath>
#include <concepts>
#include <limits>

#include "core/base/check.h"
#include "core/geometry/ball.h"
#include "core/geometry/capsule.h"
#include "core/geometry/obb.h"

namespace locus {

namespace internal {
// Returns the smallest box with coordinates of type S that contains `box`.
template <std::floating_point S>
Aabb<S> rounded_outward(const Aabbd& box) {
  if constexpr (std::same_as<S, double>) return box;
  constexpr S kInfinity = std::numeric_limits<S>::infinity();
  Aabb<S> result;
  for (int axis = 0; axis < 3; ++axis) {
    const S low = static_cast<S>(box.min[axis]), high = static_cast<S>(box.max[axis]);
    result.min[axis] = double{low} > box.min[axis] ? std::nextafter(low, -kInfinity) : low;
    result.max[axis] = double{high} < box.max[axis] ? std::nextafter(high, kInfinity) : high;
    LOCUS_DCHECK_LE(double{result.min[axis]}, box.min[axis]);
    LOCUS_DCHECK_GE(double{result.max[axis]}, box.max[axis]);
  }
  return result;
}
}  // namespace internal

// Region of a ball: overlaps() returns true for the boxes that reaches() accepts.
template <std::floating_point S>
class BallRegion {
 public:
  explicit BallRegion(const Ball<S>& ball)
      // bounds() must overlap every box that reaches() accepts. The squares of gaps below 2^-537 underflow to zero, so
      // reaches() accepts boxes at such a gap even for a radius of zero: grow the bounds by more than such a gap.
      : ball_(ball), bounds_(internal::rounded_outward<S>(grown(to_double(bounds_of(ball)), 0x1p-530))) {}

  const Aabb<S>& bounds() const { return bounds_; }
  bool overlaps(const Aabb<S>& box) const { return reaches(ball_, box); }

 private:
  Ball<S> ball_;
  Aabb<S> bounds_;
};

// Region of the axis-aligned bounds of a capsule or of a box, rotated or not. overlaps() returns true for the boxes
// that overlap these bounds; the coordinates are compared exactly.
template <std::floating_point S>
class BoxRegion {
 public:
  // Do not delegate these two to one constructor: a copy of bounds that have just been written by coordinate stalls the
  // processor for about 10 ns, because it reads two coordinates at once.
  explicit BoxRegion(const Obb<S>& box) : exact_(bounds_of(box)), bounds_(internal::rounded_outward<S>(exact_)) {}
  explicit BoxRegion(const Capsule& capsule)
      : exact_(bounds_of(capsule)), bounds_(internal::rounded_outward<S>(exact_)) {}

  const Aabb<S>& bounds() const { return bounds_; }
  bool overlaps(const Aabb<S>& box) const { return locus::overlaps(exact_, to_double(box)); }

 private:
  Aabbd exact_;
  Aabb<S> bounds_;
};

// Region of a capsule: overlaps() returns true for the boxes that may_reach() accepts and that overlap the bounds of
// the capsule. overlaps() is not monotone: near the surface of the capsule, the result depends on rounding. So a
// visitor may use this region only if the visitor's exact test of a value is stricter than overlaps() by more than this
// rounding.
class CapsuleRegion {
 public:
  explicit CapsuleRegion(const Capsule& capsule)
      : capsule_(capsule), exact_(bounds_of(capsule)), bounds_(internal::rounded_outward<float>(exact_)) {}

  const Aabbf& bounds() const { return bounds_; }
  bool overlaps(const Aabbf& box) const {
    const Aabbd wide = to_double(box);
    return locus::overlaps(exact_, wide) && may_reach(capsule_, wide);
  }

 private:
  Capsule capsule_;
  Aabbd exact_;
  Aabbf bounds_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_REGIONS_H_
