// Chord of a line: the part of the line within a convex solid, in the solid's own axes. The ray predicates of all
// solids compute the chord first and then apply the rules for rays that start inside. Plain data.
#ifndef LOCUS_CORE_GEOMETRY_CHORD_H_
#define LOCUS_CORE_GEOMETRY_CHORD_H_

#include "core/geometry/vec3.h"

namespace locus {

// Infinite line: the points origin + t * direction for every real t. `direction` is not zero and its largest component
// lies within a few powers of two of 1, so that no product over- or underflows.
struct Line {
  Vec3d origin;  // relative to the solid's centre
  Vec3d direction;
};

// Interval of t in which the line is within the solid, and the normals of the surface at both ends.
struct Chord {
  double near, far;  // near <= far, in units of the line's direction
  // Outward normals at both ends, of any positive length. A ball or capsule of radius 0 has no normals: near_normal is
  // then minus the line's direction, and far_normal is the direction.
  Vec3d near_normal, far_normal;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_CHORD_H_
