// Winding of a closed mesh around a point, by the crossings of a half line that is parallel to an axis. The winding
// number is the sum of the signed crossings of all triangles that the half line crosses: 0 outside, 1 or -1 inside,
// depending on the orientation of the mesh. Pure functions; any thread.
//
// Every sign is exact: it is computed in double if an error bound proves it, otherwise by an exact sum. So the sum of
// the crossings is the winding number of the stored mesh around the given point. Edges are half-open. For a half line
// along x, each edge is projected along x. The projected edge includes its end with the lower y, but not its end with
// the upper y. If the point lies exactly on the projected edge, the edge counts as 0. So two triangles that share an
// edge count this edge with opposite signs, and the sum is right even if the half line meets edges or corners, or runs
// along faces. Sources: Haines, Point in Polygon Strategies, Graphics Gems IV, 1994 (half-open edges); Shewchuk,
// Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997 (filters and exact signs).
//
// Every half line results in the same sum, unless the point is on the surface. Proof: the rule of half-open edges
// treats the point as if it were moved by (0, d * d, -d) for an infinitely small d > 0. The half line from the moved
// point meets no edge or corner, so the sum is the winding number around the moved point. This is the winding number
// around the point itself, because the surface is closed and does not contain the point. For a half line along another
// axis the point is moved in another direction, and the same proof applies.
//
// Crossing::on_surface tells whether the point is on the surface. Every half line determines this: if a triangle
// contains the point, the bounds of the triangle contain the point too. The point is the start of the half line, so the
// triangle is tested.
#ifndef LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_
#define LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_

#include <cmath>

#include "core/geometry/triangle.h"

namespace locus {

// Direction of a half line that begins at a point in mesh axes.
struct HalfLine {
  int axis = 0;             // axis to which the half line is parallel: 0 for x, 1 for y, 2 for z
  bool descending = false;  // true if the half line runs towards lower coordinates
};

// Contribution of one triangle.
struct Crossing {
  int winding = 0;          // 1 or -1 if the half line crosses the triangle, else 0
  bool on_surface = false;  // the point lies on the triangle, which includes its edges and vertices
};

// Returns `point` with coordinates below 2^-250 replaced by 0, so that no product of differences underflows. Apply
// this function to a point before you pass the point to crossing().
inline Vec3d without_tiny_coordinates(Vec3d point) {
  const auto kept = [](double value) { return std::abs(value) < 0x1p-250 ? 0 : value; };
  return {kept(point.x), kept(point.y), kept(point.z)};
}

// Returns the crossing of the half line from `point` with a triangle. Without `line`, the half line ascends along the x
// axis.
Crossing crossing(Vec3d point, const Triangle& triangle);
Crossing crossing(Vec3d point, const Triangle& triangle, HalfLine line);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_
