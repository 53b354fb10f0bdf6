// Winding of a closed mesh around a point, by the crossings of a ray along the x axis. The winding number is the sum of
// the crossings of all triangles that the ray meets: 0 outside, 1 or -1 inside, depending on the orientation of the
// mesh. Pure functions in double, with DoubleDouble where double leaves a sign in doubt; any thread.
//
// Edges are half-open: of two triangles that share an edge, the ray crosses exactly one, also if it meets the edge or a
// vertex. For this both triangles must compute the same sign for the edge. So its ends are always taken in the same
// order, and all differences from the point are exact.
// Source: Haines, Point in Polygon Strategies, Graphics Gems IV, 1994, for the rule of half-open edges; Shewchuk,
// Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997, for the error bounds.
#ifndef LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_
#define LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_

#include "core/geometry/triangle.h"

namespace locus {

// Contribution of one triangle.
struct Crossing {
  int winding = 0;          // 1 or -1 if the ray crosses the triangle, else 0
  bool on_surface = false;  // the point lies on the triangle, which includes its edges and vertices
};

// Returns `point` with coordinates below 2^-250 replaced by 0, so that no product of differences underflows. crossing()
// expects such a point.
Vec3d without_tiny_coordinates(Vec3d point);

// Returns the crossing of the ray from `point` along the x axis with a triangle.
Crossing crossing(Vec3d point, const Triangle& triangle);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_POINT_IN_MESH_H_
