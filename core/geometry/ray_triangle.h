// Watertight intersection of a ray and a triangle: a ray from inside a closed mesh always hits the mesh. The triangle
// is projected along the ray. Each of the three edge functions is the difference of two products. If the two vertices
// of an edge are exchanged, only the sign of its edge function changes, so an edge that two triangles share has no gap
// in spite of rounding. Boxes are culled in float, but hits are computed in double. In float the error of t would be
// the rounding error divided by the sine of the angle between ray and plane: in a measurement with float, 0.7 % of
// random rays lost the hit, or the error of the hit was larger than hit() allows. If a triangle is so nearly edge-on
// that double is not precise enough either, edge_on_hit() of edge_on_triangle.h computes the hit. Source: Woop,
// Benthin, Wald, Watertight Ray/Triangle Intersection, 2013; the code here omits the divisions of the paper, so that
// results on small integers are exact.
#ifndef LOCUS_CORE_GEOMETRY_RAY_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_RAY_TRIANGLE_H_

#include <optional>

#include "core/geometry/edge_on_triangle.h"
#include "core/geometry/ray.h"
#include "core/geometry/transform.h"
#include "core/geometry/triangle.h"

namespace locus {

// Hit of a ray on a triangle.
struct TriangleHit {
  float t;     // in units of the scaled direction
  float u, v;  // weights of the second and the third vertex
};

// Ray in mesh axes, preprocessed for slab tests in float and triangle tests in double. The direction is scaled by a
// power of two so that its largest component lies in [0.5, 1), and no later product over- or underflows; t is in units
// of the scaled direction. Immutable; cheap to copy.
class TriangleRay {
 public:
  // Makes a ray from `origin` and `direction` in mesh axes. For the slab test each component is rounded to float once;
  // the padding of the slab test covers this error.
  TriangleRay(Vec3d origin, Vec3d direction, Cull cull = Cull::kNone);
  // Makes a ray from `origin` and `direction` in world axes, for a mesh placed by `transform`. The transform to mesh
  // axes rounds the ray; nearly edge-on triangles are tested with the unrounded ray.
  TriangleRay(const Transform& transform, Vec3d origin, Vec3d direction, Cull cull = Cull::kNone);

  const SlabRay<float>& slabs() const { return slabs_; }
  Cull cull() const { return cull_; }

  // Convert t between two units: from_scaled() converts from units of the scaled direction to units of the given
  // direction, to_scaled() converts back. Both functions round monotonically. from_scaled() returns at most the largest
  // finite float for a finite t. to_scaled() rounds up, so that a limit in a culling test never excludes a hit that
  // from_scaled() rounds down to the limit.
  float from_scaled(float t) const;
  float to_scaled(float t) const;

  // Returns the hit, a pure function of ray and triangle, or nullopt. A hit requires that the watertight test accepts
  // the triangle with t >= 0, and that the slab test accepts the triangle's own box. If the origin lies on the
  // triangle, up to the rounding error of the watertight test, t is 0. t is clamped to the interval of the slab test,
  // so a tree, which culls by boxes, reports the same hits as a test of every triangle. Triangles that are exactly
  // edge-on or have no area are never hit. The error of a hit is at most 2^-21 of the magnitudes of hit and origin.
  std::optional<TriangleHit> hit(const Triangle& triangle) const;

 private:
  struct Projected;

  TriangleRay(const StoredRay& stored, Vec3d origin, Vec3d direction, Cull cull);

  Projected project(const Triangle& triangle) const;
  std::optional<TriangleHit> edge_test(const Triangle& triangle) const;
  bool is_exactly_edge_on(const Triangle& triangle) const;
  std::optional<TriangleHit> edge_on_test(const Triangle& triangle, const Projected& projected) const;
  double depth_error(const Triangle& triangle) const;

  StoredRay stored_;
  int exponent_;  // given direction = scaled direction * 2^exponent
  Vec3d origin_, direction_;
  double origin_magnitude_;  // largest |component| of the origin
  SlabRay<float> slabs_;
  Cull cull_;
  int axis_x_, axis_y_, axis_z_;  // axes of the projection; axis_z_: axis of the direction's largest component
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_TRIANGLE_H_
