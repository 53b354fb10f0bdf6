// Distance between two shapes, and the extent of a shape along a direction. Both are closed solids. Pure functions of
// products, sums, quotients and square roots in double, in a fixed order; any thread.
#ifndef LOCUS_CORE_GEOMETRY_SHAPE_DISTANCE_H_
#define LOCUS_CORE_GEOMETRY_SHAPE_DISTANCE_H_

#include "core/geometry/shape.h"
#include "core/geometry/triangle.h"

namespace locus {

// Returns the distance between the solids; 0 if they share a point. The result is never less than the distance between
// their own bounds, so shapes may be culled by boxes that contain these bounds. Exchanging the shapes may change the
// rounding: callers that need one result for a pair order it, for example by id. O(1); two boxes that are apart are
// compared by all of their edges, which takes microseconds.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1 (distances of the features of convex solids).
double distance_between(const Shape& a, const Shape& b);

// Returns the distance between two boxes; 0 if they share a point.
double distance_between(const Aabbd& a, const Aabbd& b);

// Return the least dot product of `direction`, of length 1, with a point of the shape, of the triangle with these
// corners, or of the box.
double least_along(Vec3d direction, const Shape& shape);
double least_along(Vec3d direction, const Corners& corners);
double least_along(Vec3d direction, const Aabbd& box);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SHAPE_DISTANCE_H_
