// From a point to the shapes of moving objects, closed solids in double: how far they are, and where their nearest
// point lies. Pure functions: products, sums, quotients and square roots in a fixed order. O(1).
#ifndef LOCUS_CORE_GEOMETRY_POINT_SHAPE_H_
#define LOCUS_CORE_GEOMETRY_POINT_SHAPE_H_

#include "core/geometry/shape.h"

namespace locus {

// A ball is a core, its centre, grown by a radius; a capsule its inner segment; boxes and points are grown by nothing.
double core_radius(const Shape& shape);
double squared_distance_to_core(Vec3d point, const Shape& shape);

// 0 inside and on the surface; else to the surface, and no nearer than the shape's own bounds: a box around them is
// never farther.
double distance(Vec3d point, const Shape& shape);

// The point of the solid that distance() measures to, up to rounding: `point` itself inside.
Vec3d nearest_on_shape(Vec3d point, const Shape& shape);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_POINT_SHAPE_H_
