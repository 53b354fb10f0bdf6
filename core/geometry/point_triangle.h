// From a point to a triangle, in double: how far it is, and where on it the nearest point lies. A triangle is a closed
// surface; one without area is the segment or point that it is. Pure functions, products, sums and quotients in a fixed
// order. O(1).
#ifndef LOCUS_CORE_GEOMETRY_POINT_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_POINT_TRIANGLE_H_

#include "core/geometry/triangle.h"

namespace locus {

// The least of three clamped segment distances and, where the foot of the perpendicular lies inside, of the distance to
// the plane, by cross products and one division each: exact where the result is a small whole number. No cancellation
// drops a sliver.
double squared_distance(Vec3d point, Vec3d a, Vec3d b, Vec3d c);
double squared_distance(Vec3d point, const Triangle& triangle);

// The point of the triangle that squared_distance() measures to, up to rounding.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.5, without its regions, which triangles without area upset.
Vec3d nearest_on_triangle(Vec3d point, Vec3d a, Vec3d b, Vec3d c);

// As squared_distance(), and no nearer than the triangle's own box: a box around it is never farther.
double distance(Vec3d point, const Triangle& triangle);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_POINT_TRIANGLE_H_
