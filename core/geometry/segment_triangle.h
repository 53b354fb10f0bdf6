// Distance between a segment and a triangle. A triangle is a closed surface; a triangle without area is a segment or a
// point. The segment consists of the points center + s * half_axis, -1 <= s <= 1; with a zero half axis it is a point.
// Pure functions in double; O(1); any thread.
#ifndef LOCUS_CORE_GEOMETRY_SEGMENT_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_SEGMENT_TRIANGLE_H_

#include "core/geometry/vec3.h"

namespace locus {

// Returns whether the segment crosses the triangle, by the signs of five volumes; signs that may be rounding errors are
// computed in extended precision. Two triangles that share an edge have exactly opposite signs for it, so a segment
// cannot pass between them. A segment that is reported crosses the triangle, up to a few roundings of the coordinates.
// One that only touches it, or lies in its plane, up to such roundings, may be reported either way.
// Source: Moller, Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997, for the volumes.
bool segment_crosses_triangle(Vec3d center, Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c);

// Returns the squared distance between the segment and the triangle; 0 if the segment crosses the triangle. If not,
// the result is the minimum of five squared distances: from the two ends of the segment to the triangle, and from the
// segment to the three edges. The result is at least the exact squared distance, except for an error of a few
// roundings of the coordinates.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.10.
double squared_distance_segment_triangle(Vec3d center, Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SEGMENT_TRIANGLE_H_
