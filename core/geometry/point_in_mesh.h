// Winding of a closed mesh around a point, by the crossings of a ray along the x axis. The winding number is the sum of
// the crossings of all triangles that the ray meets: 0 outside, 1 or -1 inside, depending on the orientation of the
// mesh. Pure functions; any thread.
//
// Every sign is exact: computed in double where an error bound proves it, otherwise as an exact sum. So the sum is the
// winding number of the stored mesh around the given point. Edges are half-open: an edge includes its lower end in y
// and not its upper one, and no point that is exactly on it. Triangles that share an edge therefore count it with
// opposite signs, and the sum is right if the ray meets edges or corners, or runs along faces. Source: Haines, Point in
// Polygon Strategies, Graphics Gems IV, 1994, for the rule of half-open edges; Shewchuk, Adaptive Precision
// Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997, for filters and exact signs.
#ifndef LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_
#define LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_

#include <cmath>

#include "core/geometry/triangle.h"

namespace locus {

// Contribution of one triangle.
struct Crossing {
  int winding = 0;          // 1 or -1 if the ray crosses the triangle, else 0
  bool on_surface = false;  // the point lies on the triangle, which includes its edges and vertices
};

// Returns `point` with coordinates below 2^-250 replaced by 0, so that no product of differences underflows. crossing()
// expects such a point.
inline Vec3d without_tiny_coordinates(Vec3d point) {
  const auto kept = [](double value) { return std::abs(value) < 0x1p-250 ? 0 : value; };
  return {kept(point.x), kept(point.y), kept(point.z)};
}

// Returns the crossing of the ray from `point` along the x axis with a triangle.
Crossing crossing(Vec3d point, const Triangle& triangle);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_
