// Distance from a point to the shape of a moving object, a closed solid, and the shape's nearest point. Pure functions
// in double: products, sums, quotients and square roots in a fixed order. O(1); any thread.
#ifndef LOCUS_CORE_GEOMETRY_POINT_SHAPE_H_
#define LOCUS_CORE_GEOMETRY_POINT_SHAPE_H_

#include "core/geometry/shape.h"

namespace locus {

// Returns the radius by which a shape extends beyond its core. The core of a ball is its centre, the core of a capsule
// its inner segment. A box or a point is its own core, with a radius of 0.
double core_radius(const Shape& shape);
// Returns the squared distance from `point` to the core of the shape; 0 inside a box.
double squared_distance_to_core(Vec3d point, const Shape& shape);

// Returns the distance from `point` to the shape, 0 inside. It is never less than the distance to the shape's own
// bounds, so a shape may be culled by any box that contains these bounds.
double distance(Vec3d point, const Shape& shape);

// Returns the point of the solid nearest to `point`, up to rounding: `point` itself if it is inside.
Vec3d nearest_on_shape(Vec3d point, const Shape& shape);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_POINT_SHAPE_H_
