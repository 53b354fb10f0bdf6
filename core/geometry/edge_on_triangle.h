// Ray against a triangle that is seen nearly edge-on. There a hit is moved, by as much as the sine of the angle is
// small, by every rounding on the way into mesh axes and in the edge functions: at 2^-28 by more than the product
// allows. So everything is done again with twice double's precision, from the stored values on; no quotient and no
// root is needed before t itself. Functions without state.
#ifndef LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_

#include <optional>

#include "core/geometry/ray.h"
#include "core/geometry/stored_ray.h"
#include "core/geometry/triangle.h"

namespace locus {

struct EdgeOnHit {
  double t;  // >= 0, in units of the given direction
  double u, v;
};

// What double can tell of the pair.
struct EdgeOnVerdict {
  bool hit;     // by the signs of the edge functions, whatever t
  double blur;  // how far rounding may move a corner of the triangle across the ray: a length in mesh axes
};

// The hit where the ray meets the triangle as precisely as that, at t >= 0 or less than the blur behind its start.
//
// Where it does not, but double says that it hits, the hit is the place of the triangle's border that is nearest to the
// ray and not behind it, if it is nearer than the blur. So no ray slips out between this triangle and a neighbour that
// is not edge-on and decided in double: what double alone accepts is accepted here too. Only the side that is seen,
// which culling asks for, is never taken from double; a triangle that is exactly edge-on has none.
//
// `ray`: its direction so long that the largest component in mesh axes lies within [0.5, 1).
std::optional<EdgeOnHit> edge_on_hit(const StoredRay& ray, const Triangle& triangle, Cull cull,
                                     EdgeOnVerdict in_double);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_EDGE_ON_TRIANGLE_H_
