// Closed capsules in double: all points at a distance of at most `radius` from an inner segment. An inner segment of
// length zero and a radius of zero are legal. Plain data and pure functions of products, sums, quotients and square
// roots in a fixed order; any thread.
#ifndef LOCUS_CORE_GEOMETRY_CAPSULE_H_
#define LOCUS_CORE_GEOMETRY_CAPSULE_H_

#include "core/geometry/shape.h"
#include "core/geometry/triangle.h"

namespace locus {

struct Capsule {
  Vec3d center;       // midpoint of the inner segment
  Vec3d half_axis;    // from the midpoint to one end of the inner segment
  double radius = 0;  // >= 0
};

// Returns the axis-aligned bounds, grown by 2^-40 of the sum of the magnitudes of the centre, the half axis and the
// radius.
Aabbd bounds_of(const Capsule& capsule);

// Returns whether the box overlaps the capsule's bounds and shares a point with an enlarged copy of the capsule. The
// radius of the copy is larger by 2^-40 of the sum of the magnitudes of capsule and box. The enlargement covers the
// rounding of the box's coordinates.
bool reaches(const Capsule& capsule, const Aabbd& box);

// Returns true for every box that contains a point of the capsule. May also return true for a box that the capsule
// misses, because the test replaces the ball of the capsule's radius by the cube around the ball. Costs six comparisons
// and no division.
bool may_reach(const Capsule& capsule, const Aabbd& box);

// Returns whether the capsule shares a point with the shape; touching counts. The result is true only if reaches() is
// also true for the shape's own bounds, so culling by any superset of these bounds never changes the result.
bool capsule_overlaps(const Capsule& capsule, const Shape& shape);

// Returns whether the capsule shares a point with the triangle, which is a closed surface. The result is true only if
// the bounds of the capsule also overlap the triangle's own bounds.
bool capsule_overlaps(const Capsule& capsule, const Triangle& triangle);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_CAPSULE_H_
