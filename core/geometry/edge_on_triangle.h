// Intersection of a ray with a triangle that is nearly edge-on to it. Rounding errors of the transform to mesh axes and
// of the edge functions move such a hit by the error divided by the sine of the angle between ray and plane. At a sine
// of 2^-28 this exceeds the allowed error of a hit (TriangleRay::hit()). So the test is repeated in DoubleDouble, from
// the stored, unrounded values. It needs no quotient before t, and no square root. Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_

#include <optional>

#include "core/geometry/ray.h"
#include "core/geometry/stored_ray.h"
#include "core/geometry/triangle.h"

namespace locus {

// Hit and its barycentric weights.
struct EdgeOnHit {
  double t;     // >= 0, in units of the given direction
  double u, v;  // weights of the second and the third vertex
};

// Result of the test in double for the same ray and triangle.
struct EdgeOnVerdict {
  bool hit;             // true if the signs of the edge functions show a hit, whatever its t
  double corner_error;  // bound of a corner's rounding error perpendicular to the ray, a length in mesh axes
};

// Returns the hit in extended precision if the ray meets the triangle at t >= -corner_error; a negative t is returned
// as 0.
//
// If the ray misses in extended precision but hits in double, returns the point of the triangle's border nearest to the
// ray among those with t >= 0, provided that its distance from the ray is at most the corner error. So a hit in double
// stays a hit, and no ray leaks between this triangle and a neighbour that is decided in double because it is not
// edge-on. Only the visible side, which decides culling, is never taken from double; a triangle that is exactly edge-on
// has no visible side, so Cull::kBack and Cull::kFront both ignore it.
//
// Precondition: the largest component of the direction of `ray` in mesh axes lies within [0.5, 1).
std::optional<EdgeOnHit> edge_on_hit(const StoredRay& ray, const Triangle& triangle, Cull cull,
                                     EdgeOnVerdict double_verdict);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_
