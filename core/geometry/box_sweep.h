// Motion of a convex polytope (a triangle or a box) towards a resting box: computes the time during which they share a
// point, by the separating axis test over time. On each axis, both polytopes project to intervals, which overlap during
// one interval of time. The polytopes share a point in the intersection of these intervals of time.
// Source: Eberly, Dynamic Collision Detection Using Oriented Bounding Boxes, 1999.
//
// All vectors are relative to the resting box's centre, in the resting box's axes. Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_BOX_SWEEP_H_
#define LOCUS_CORE_GEOMETRY_BOX_SWEEP_H_

#include <optional>

#include "core/geometry/ray.h"
#include "core/geometry/rotation.h"

namespace locus {

// The time during which two polytopes share a point.
struct BoxOverlap {
  Interval<double> time;  // computed for an endless motion, so it may begin before t = 0
  // Unit vector from the moving polytope to the resting box. If the polytopes overlap at t = 0, it is the direction of
  // the shortest way out: the shortest translation of the resting box that separates them. If not, it is the axis that
  // separates the polytopes until the first moment of overlap.
  Vec3d normal;
  double depth = 0;  // length of the shortest way out at t = 0; no meaning if the polytopes do not overlap then
};

// Return the overlap of a resting box of half extents `half` with a moving triangle or a moving box; `velocity` is the
// velocity of this triangle or box. Return nullopt if the two never share a point. To cover rounding errors, the
// projections are widened by 2^-46 of the magnitudes involved, so a contact is never missed. Triangles without area
// and half extents of zero are legal.
std::optional<BoxOverlap> overlap_with_triangle(Vec3d half, Vec3d a, Vec3d b, Vec3d c, Vec3d velocity);
// `center`, `other_half` and `rotation` are the centre, half extents and rotation of the moving box, in the resting
// box's axes.
std::optional<BoxOverlap> overlap_with_box(Vec3d half, Vec3d center, Vec3d other_half, const Rotation& rotation,
                                           Vec3d velocity);

// Return a point of the triangle, or of the other box, that lies in the box of half extents `half`. This box is first
// widened by 2^-36 of the sum of its largest half extent and the largest |coordinate| of the triangle or other box, to
// cover rounding errors. If there is no such point, return the point of the triangle, or of the other box, that is
// nearest to the centre of the box.
Vec3d shared_point(Vec3d half, Vec3d a, Vec3d b, Vec3d c);
Vec3d shared_point(Vec3d half, Vec3d center, Vec3d other_half, const Rotation& rotation);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_BOX_SWEEP_H_
