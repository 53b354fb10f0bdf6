// Nearest points of a segment and a primitive: a segment, a triangle or a box. The segment consists of the points s *
// half_axis, -1 <= s <= 1; with a zero half axis it is the origin, a point. All positions are relative to the segment's
// midpoint. Pure functions in double: products, sums, quotients in a fixed order; O(1); any thread.
#ifndef LOCUS_CORE_GEOMETRY_NEAREST_PAIR_H_
#define LOCUS_CORE_GEOMETRY_NEAREST_PAIR_H_

#include <limits>

#include "core/geometry/vec3.h"

namespace locus {

// Point of the segment and point of the primitive that are nearest to each other. The two points are equal, up to
// rounding, if segment and primitive intersect.
struct NearestPair {
  double squared_distance = std::numeric_limits<double>::infinity();
  Vec3d on_segment;
  Vec3d on_primitive;

  Vec3d offset() const { return on_segment - on_primitive; }
};

// Returns the nearest points of two segments. `center` and `other_half_axis` are the midpoint and the half axis of the
// second segment, which is the primitive.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.9.
NearestPair nearest_to_segment(Vec3d half_axis, Vec3d center, Vec3d other_half_axis);

// Returns the nearest points of the segment and the triangle with corners a, b and c. The triangle may have no area.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.10.
NearestPair nearest_to_triangle(Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c);

// Returns the nearest points of the segment and the box of half extents `half` around `center`, in the box's own axes.
// The distance to the box is convex along the segment; its minimum lies at one of at most eight breakpoints or inside
// one of the seven ranges between them.
NearestPair nearest_to_box(Vec3d half_axis, Vec3d center, Vec3d half);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_NEAREST_PAIR_H_
