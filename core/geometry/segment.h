// Distances between a segment and a point, a segment or a box. The segment consists of the points s * half_axis, -1 <=
// s <= 1, relative to its midpoint; with a zero half axis it is a point. The argument `point` is relative to the
// midpoint, too. Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_SEGMENT_H_
#define LOCUS_CORE_GEOMETRY_SEGMENT_H_

#include "core/geometry/vec3.h"

namespace locus {

// Returns the point of the segment nearest to `point`.
Vec3d nearest_on_segment(Vec3d point, Vec3d half_axis);

// Returns the squared distance from `point` to the segment. If the nearest point is not an end of the segment, the
// distance is computed by a cross product and one division: exact if the result is a small integer, otherwise the error
// of the distance is a few roundings of |point|.
double squared_distance_to_segment(Vec3d point, Vec3d half_axis);

// Returns the squared distance between two segments. `offset` is the midpoint of the second relative to the midpoint of
// the first. The result is the minimum of up to five distances: four between an end of one segment and the other
// segment, and one between the nearest points of the two lines. The fifth distance counts only if these points lie
// inside the segments. Since every candidate is a distance between points of the segments, cancellation for nearly
// parallel segments never makes the result too small.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.9.
double squared_distance_segments(Vec3d offset, Vec3d half_axis, Vec3d other_half_axis);

// Returns whether the segment with midpoint `center` intersects the closed box of half extents `half` around the
// origin: separating axis test over six axes, without division.
bool segment_meets_box(Vec3d center, Vec3d half_axis, Vec3d half);

// Returns the squared distance between the segment and the box, which are given as in segment_meets_box(); 0 if they
// intersect. As a function of s, the squared distance of a point of the segment is convex and consists of at most seven
// parabolas; the minimum of each parabola is computed in closed form.
double squared_distance_segment_box(Vec3d center, Vec3d half_axis, Vec3d half);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SEGMENT_H_
