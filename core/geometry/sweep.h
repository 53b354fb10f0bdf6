// Sweeps: the first moment at which a mover shares a point with a shape or a triangle, and the contact there. Movers
// and shapes are closed solids, so touching counts. A triangle is a closed surface with two sides. Points, and
// triangles without area, are found too.
//
// Error bounds: let the mover be shrunk by 2^-20 of the sum of its distance from the origin and its size. If the shrunk
// mover hits the primitive, the sweep reports a hit at the same time or earlier. At a reported hit, the distance
// between mover and primitive is at most about 2^-44 of the magnitudes involved.
//
// Pure functions in double, of products, sums, quotients and square roots in a fixed order. O(1); any thread.
#ifndef LOCUS_CORE_GEOMETRY_SWEEP_H_
#define LOCUS_CORE_GEOMETRY_SWEEP_H_

#include <optional>

#include "core/geometry/ball.h"
#include "core/geometry/capsule.h"
#include "core/geometry/mover.h"
#include "core/geometry/obb.h"
#include "core/geometry/shape.h"
#include "core/geometry/transform.h"
#include "core/geometry/triangle.h"

namespace locus {

// Return a ball, a capsule or a box as a mover that rests. contact_at() of this mover at t = 0 returns the distance and
// the nearest point of a primitive, as seen from the ball's centre or the capsule's inner segment. For a box, it
// returns the contact with a primitive that the box overlaps, see Contact.
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

inline Mover resting(const Obbd& box) {
  Mover mover;
  mover.kind = MoverKind::kBox;
  mover.start = box.center;
  mover.half = box.half;
  mover.rotation = box.rotation;
  return mover;
}

// Returns the mover in mesh axes. A time t means the same in world axes and in mesh axes.
Mover mover_to_mesh(const Mover& mover, const Transform& transform);

// Returns true if one edge of the triangle, as seen along the path, separates the triangle from a ball or capsule. The
// mover then misses the triangle, even if it moves without end. The corners are relative to the mover's start. May
// return false for a mover that misses, but never returns true if RoundSweep finds a contact. Public for its test.
bool misses_along_path(const Mover& mover, const Corners& corners);

// Return the first moment of contact in 0 .. limit, or nullopt. `at_start` selects the result for a primitive that is
// touched at t = 0.
std::optional<double> first_contact(const Mover& mover, const Shape& shape, AtStart at_start, double limit = 1);
std::optional<double> first_contact(const Mover& mover, const Corners& triangle, AtStart at_start, double limit = 1);

// Return the contact at time t. Usually mover and primitive touch at this time, but the contact is defined at every t.
// See Contact for the cases in which its distance is defined.
Contact contact_at(const Mover& mover, const Shape& shape, double t);
Contact contact_at(const Mover& mover, const Corners& triangle, double t);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SWEEP_H_
