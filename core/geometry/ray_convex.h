// Intersection of a line with a closed convex solid (a ball, a capsule or a box) around the origin, in the solid's own
// axes. ray_hit() in shape.h computes the chord by these functions and then applies the rules for rays that start
// inside. Plain data and pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_RAY_CONVEX_H_
#define LOCUS_CORE_GEOMETRY_RAY_CONVEX_H_

#include <optional>

#include "core/geometry/ray.h"

namespace locus {

// Infinite line: the points origin + t * direction for every real t. `direction` is not zero and its largest component
// lies within a few powers of two of 1, so that no product over- or underflows.
struct Line {
  Vec3d origin;  // relative to the solid's centre
  Vec3d direction;
};

// Chord of a line: the interval of t in which the line is within the solid, and the normals of the surface at both
// ends.
struct Chord {
  double near, far;  // near <= far, in units of the line's direction
  // Outward normals at both ends, of any positive length. A ball or capsule of radius 0 has no normals: near_normal is
  // then minus the line's direction, and far_normal is the direction.
  Vec3d near_normal, far_normal;
};

// Returns the interval of t with |origin + t * direction|^2 <= squared_radius; nullopt if the interval is empty. The
// distance from the line to the ball's centre is computed by a cross product. The cross product is exact for small
// integers. Unlike the discriminant b^2 - 4ac, it has no cancellation for far origins. A zero direction is legal: the
// interval is then infinite or empty.
std::optional<Interval<double>> line_in_ball(const Line& line, double squared_radius);

// Returns the chord of the line in the ball of the given radius; nullopt if the line misses the ball. A tangent has a
// chord of length zero.
std::optional<Chord> chord_of_ball(const Line& line, double radius);

bool ball_contains(double radius, Vec3d point);

// Returns the chord of the line in a capsule: all points within `radius` of the segment from -half_axis to half_axis;
// nullopt if the line misses the capsule. With a zero half axis the capsule is a ball, with a zero radius a segment.
// The chord is the union of the chords of both end balls and of the cylinder between them: one chord, since a capsule
// is convex.
std::optional<Chord> chord_of_capsule(const Line& line, Vec3d half_axis, double radius);

bool capsule_contains(Vec3d half_axis, double radius, Vec3d point);

// Returns the chord of the line in the box of half extents `half` >= 0; nullopt if the line misses the box. A line in
// the plane of a face, along an edge or through a corner touches the box. Planes that are crossed at the same real t
// give the same rounded quotient, so touching a corner or an edge is exact if the differences to the planes are exact.
// If several faces are crossed at the same t, the normal is that of the first axis in the order x, y, z.
std::optional<Chord> chord_of_box(const Line& line, Vec3d half);

bool box_contains(Vec3d half, Vec3d point);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_CONVEX_H_
