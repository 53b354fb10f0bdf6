// Distance between two shapes, and the extent of a shape along a direction. Shapes are closed solids. Pure
// functions; any thread. They compute only with sums, products, quotients and square roots of doubles, in a fixed
// order, so that results are the same on every machine.
#ifndef LOCUS_CORE_GEOMETRY_SHAPE_DISTANCE_H_
#define LOCUS_CORE_GEOMETRY_SHAPE_DISTANCE_H_

#include <algorithm>
#include <cmath>

#include "core/geometry/ball.h"
#include "core/geometry/shape.h"
#include "core/geometry/triangle.h"

namespace locus {

// Returns the distance between the solids; 0 if they share a point. The result is never less than the distance between
// the bounds of the solids, so shapes may be culled by boxes that contain these bounds. If the two arguments are
// exchanged, the rounding may change, so callers that need a symmetric result must order the shapes, for example by
// id. O(1); two boxes that are apart are compared by all of their edges, which takes microseconds.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1 (distances of the features of convex solids).
double distance_between(const Shape& a, const Shape& b);

// Returns the distance between two boxes; 0 if they share a point.
double distance_between(const Aabbd& a, const Aabbd& b);

// Returns the distance between two balls, bit for bit the result for two shapes that are these balls, but faster. The
// bounds of balls are grown by 2^-40 of their magnitudes, which is more than all rounding errors. Therefore `gaps` are
// at least the gaps between the bounds along the axes, up to a few roundings of their own, and if the condition below
// holds, the bounds are no farther apart than the balls.
inline double distance_between(const Balld& a, const Balld& b) {
  const Vec3d offset = b.center - a.center;
  const double apart = std::sqrt(squared_length(offset)) - a.radius - b.radius;
  const double radii = a.radius + b.radius;
  const Vec3d gaps = max(abs(offset) - Vec3d{radii, radii, radii}, Vec3d{});
  if (apart > 0 && apart * apart > squared_length(gaps) * (1 + 0x1p-48)) return apart;
  return std::max(apart, distance_between(bounds_of(a), bounds_of(b)));
}

// Return the least dot product of the unit vector `direction` with any point of the shape, of the triangle with these
// corners, or of the box.
double least_along(Vec3d direction, const Shape& shape);
double least_along(Vec3d direction, const Corners& corners);
double least_along(Vec3d direction, const Aabbd& box);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SHAPE_DISTANCE_H_
