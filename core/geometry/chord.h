// The part of a whole line within a convex solid, in the solid's own axes: what every ray predicate of solids computes
// before the rules about origins inside are applied. Plain data.
#ifndef LOCUS_CORE_GEOMETRY_CHORD_H_
#define LOCUS_CORE_GEOMETRY_CHORD_H_

#include "core/geometry/vec3.h"

namespace locus {

// Points origin + t * direction for every real t. `direction` is not zero and its largest component lies within a few
// powers of two of 1, so that no product over- or underflows.
struct Line {
  Vec3d origin;  // relative to the solid's centre
  Vec3d direction;
};

struct Chord {
  double near, far;  // near <= far, in units of the line's direction
  // Outward normals there, of any positive length. Against and along the direction where the solid has no thickness.
  Vec3d near_normal, far_normal;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_CHORD_H_
