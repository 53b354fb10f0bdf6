// Distance from a point to a triangle, and the triangle's nearest point. A triangle is a closed surface; a triangle
// without area is a segment or a point. Pure functions in double: products, sums and quotients in a fixed order. O(1);
// any thread.
#ifndef LOCUS_CORE_GEOMETRY_POINT_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_POINT_TRIANGLE_H_

#include "core/geometry/triangle.h"

namespace locus {

// Returns the squared distance from `point` to the triangle: the minimum of the squared distances to the three edges
// and, if the projection of `point` lies inside the triangle, to its plane. Each of the four distances is computed by
// cross products and one division, so a result that is a small integer is exact. For a sliver triangle, whose normal
// suffers from cancellation, the distance to the projected point replaces the distance to the plane.
double squared_distance(Vec3d point, Vec3d a, Vec3d b, Vec3d c);
double squared_distance(Vec3d point, const Triangle& triangle);

// Returns the point of the triangle nearest to `point`, up to rounding.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.5, without its region tests, which fail for triangles
// without area.
Vec3d nearest_on_triangle(Vec3d point, Vec3d a, Vec3d b, Vec3d c);

// Returns the distance from `point` to the triangle. The result is never less than the distance to the triangle's own
// bounds, so a triangle may be culled by any box that contains these bounds.
double distance(Vec3d point, const Triangle& triangle);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_POINT_TRIANGLE_H_
