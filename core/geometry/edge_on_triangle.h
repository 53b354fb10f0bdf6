// Ray against a triangle that is nearly edge-on. The rounding errors of the transform to mesh axes and of the edge
// functions move a hit by the error divided by the sine of the angle between ray and plane: for a sine of 2^-28 by more
// than the product allows. So the test is repeated in DoubleDouble, from the stored values on; t is the first value
// that needs a quotient, and no square root is needed. Pure functions; any thread.
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

// Result of the test in double for a ray and a triangle.
struct EdgeOnVerdict {
  bool hit;             // by the signs of the edge functions, for any t
  double corner_error;  // largest rounding error of a corner perpendicular to the ray, a length in mesh axes
};

// Returns the hit in extended precision if the ray meets the triangle at t >= 0, or at most the corner error before its
// origin.
//
// If the ray misses in extended precision but hits in double, returns the point of the triangle's border nearest to the
// ray with t >= 0, provided that it is within the corner error. So no ray leaks between this triangle and a neighbour
// that is not edge-on and therefore decided in double: every hit in double is also a hit here. Only the visible side,
// which decides culling, is never taken from double; a triangle that is exactly edge-on has no visible side.
//
// Precondition: the largest component of the direction of `ray` in mesh axes lies within [0.5, 1).
std::optional<EdgeOnHit> edge_on_hit(const StoredRay& ray, const Triangle& triangle, Cull cull,
                                     EdgeOnVerdict double_verdict);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_
