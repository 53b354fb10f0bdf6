// Distances to and from a segment given as the points s * half_axis, -1 <= s <= 1, in axes around its middle. A zero
// half axis is a point.
#ifndef LOCUS_CORE_GEOMETRY_SEGMENT_H_
#define LOCUS_CORE_GEOMETRY_SEGMENT_H_

#include "core/geometry/vec3.h"

namespace locus {

Vec3d nearest_on_segment(Vec3d point, Vec3d half_axis);

// Beside the segment the distance is judged by a cross product and one division: exact where the result is a small
// whole number, and within a few roundings of |point| elsewhere.
double squared_distance_to_segment(Vec3d point, Vec3d half_axis);

// Whether the segment around `center` meets the closed box of half extents `half` around the origin of its own axes,
// by six separating axes without division.
bool segment_meets_box(Vec3d center, Vec3d half_axis, Vec3d half);

// Squared distance of that segment to that box, 0 where they meet. The squared distance along the segment is a convex
// chain of at most seven parabolas; the least value of each is found in closed form.
double squared_distance_segment_box(Vec3d center, Vec3d half_axis, Vec3d half);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SEGMENT_H_
