// Solid that moves in a straight line without turning: a ball, a capsule or a box. Plain data; any thread.
#ifndef LOCUS_CORE_GEOMETRY_MOVER_H_
#define LOCUS_CORE_GEOMETRY_MOVER_H_

#include <cstdint>

#include "core/geometry/rotation.h"

namespace locus {

enum class MoverKind : uint8_t { kBall, kCapsule, kBox };

// Solid in motion: its centre is at start + t * way at the time t, 0 <= t <= 1. A zero way is legal.
struct Mover {
  MoverKind kind = MoverKind::kBall;
  Vec3d start;
  Vec3d way;
  double radius = 0;  // ball and capsule: >= 0
  Vec3d half_axis;    // capsule: from the centre to one end of the inner segment; zero for a ball
  Vec3d half;         // box: half extents along its own axes, >= 0
  Rotation rotation;  // box: rotates the box's own axes to the axes of `start`
};

// Treatment of a primitive that the mover touches at t = 0. kHit: the primitive is hit at t = 0. kApproach: the
// primitive is hit at t = 0 if the mover moves against the contact's normal, and is ignored otherwise. kPass: the
// primitive is ignored.
enum class AtStart : uint8_t { kHit, kApproach, kPass };

// Contact of a mover with a primitive.
struct Contact {
  // Ball or capsule: distance from the primitive to the mover's centre or inner segment. If this centre or segment
  // reaches into a shape, the distance is negative: it is minus the length of the shortest way out of the shape.
  // Box: defined only at t = 0, and only if the box overlaps the primitive at t = 0: minus the length of the box's
  // shortest way out of the primitive.
  double distance = 0;
  // Point of the primitive, relative to the mover's start, so that no precision is lost far from the world's origin. If
  // mover and primitive touch, the point belongs to both, up to rounding.
  Vec3d point;
  Vec3d normal;  // unit vector from the primitive to the mover
};

// Returns the half extents of the mover's axis-aligned bounds.
inline Vec3d extent_of(const Mover& mover) {
  const Vec3d radius{mover.radius, mover.radius, mover.radius};
  switch (mover.kind) {
    case MoverKind::kBall:
      return radius;
    case MoverKind::kCapsule:
      return abs(mover.half_axis) + radius;
    case MoverKind::kBox:
      return mover.rotation.extent_to_world(mover.half);
  }
  return {};
}

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_MOVER_H_
