// Sweeps: the first moment at which a mover shares a point with a shape or a triangle, and the contact there. Both are
// closed solids, so touching counts; a triangle is a closed surface with two sides. Points, and triangles without area,
// are found too.
//
// Error: if the mover, shrunk by 2^-20 of its distance from the origin and its size, hits the primitive, the sweep hits
// no later. A hit is reported at most about 2^-44 of the magnitudes involved before the solids touch.
//
// Pure functions in double, of products, sums, quotients and square roots in a fixed order. O(1); any thread.
#ifndef LOCUS_CORE_GEOMETRY_SWEEP_H_
#define LOCUS_CORE_GEOMETRY_SWEEP_H_

#include <optional>

#include "core/geometry/ball.h"
#include "core/geometry/capsule.h"
#include "core/geometry/mover.h"
#include "core/geometry/shape.h"
#include "core/geometry/transform.h"
#include "core/geometry/triangle.h"

namespace locus {

// Return a ball or a capsule as a mover that rests. Its contact_at() time 0 measures from the centre or inner segment.
inline Mover resting(const Balld& ball) {
  Mover mover;
  mover.start = ball.center;
  mover.radius = ball.radius;
  return mover;
}
inline Mover resting(const Capsule& capsule) {
  Mover mover;
  mover.kind = MoverKind::kCapsule;
  mover.start = capsule.center;
  mover.half_axis = capsule.half_axis;
  mover.radius = capsule.radius;
  return mover;
}

// Returns the mover in mesh axes. Time is the same in both axes.
Mover mover_to_mesh(const Mover& mover, const Transform& transform);

// Return the first moment of contact in 0 .. limit, or nullopt. `at_start` selects the result for a primitive that is
// touched at t = 0.
std::optional<double> first_contact(const Mover& mover, const Shape& shape, AtStart at_start, double limit = 1);
std::optional<double> first_contact(const Mover& mover, const Corners& triangle, AtStart at_start, double limit = 1);

// Return the contact at time t, at which the solids touch. Also defined if they do not.
Contact contact_at(const Mover& mover, const Shape& shape, double t);
Contact contact_at(const Mover& mover, const Corners& triangle, double t);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SWEEP_H_
