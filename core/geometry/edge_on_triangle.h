// Intersection of a ray with a triangle that is nearly edge-on to it. A rounding error of the transform to mesh axes or
// of the edge functions moves such a hit by this error divided by the sine of the angle between ray and plane. At a
// sine of 2^-28 this displacement exceeds the allowed error of a hit (TriangleRay::hit()). So edge_on_hit() repeats the
// test in DoubleDouble, from the stored, unrounded values. The computation in DoubleDouble uses neither division nor
// square root. Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_

#include <optional>

#include "core/geometry/ray.h"
#include "core/geometry/rotation.h"
#include "core/geometry/triangle.h"

namespace locus {

// Ray in world axes and transform of the mesh: the unrounded input from which a ray in mesh axes is computed. world =
// translation + scale * (rotation * mesh), with the rotation of quaternion / |quaternion|.
struct StoredRay {
  Vec3d origin, direction;  // in world axes
  Vec3d translation;
  Quaternion quaternion;
  float scale = 1;
};

// Hit and its barycentric weights.
struct EdgeOnHit {
  double t;     // >= 0, in units of the given direction
  double u, v;  // weights of the second and the third vertex
};

// Result of the test in double for the same ray and triangle.
struct EdgeOnVerdict {
  bool hit;             // true if the signs of the edge functions show a hit, at any t
  double corner_error;  // bound of a corner's rounding error perpendicular to the ray, a length in mesh axes
};

// Returns the hit in extended precision if the ray intersects the triangle at t >= -corner_error; a negative t is
// returned as 0.
//
// If the ray misses in extended precision but hits in double, the result is a point of the triangle's border: of the
// points with t >= 0, the one nearest to the ray. It is returned only if its distance from the ray is at most
// corner_error. So a hit in double stays a hit, and no ray leaks between this triangle and a neighbour that is not
// nearly edge-on and is therefore tested in double. The visible side of the triangle, on which culling depends, is
// always computed in extended precision; a triangle that is exactly edge-on has no visible side, so Cull::kBack and
// Cull::kFront both ignore it.
//
// Precondition: the largest component of the direction of `ray` in mesh axes lies within [0.5, 1).
std::optional<EdgeOnHit> edge_on_hit(const StoredRay& ray, const Triangle& triangle, Cull cull,
                                     EdgeOnVerdict double_verdict);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_
