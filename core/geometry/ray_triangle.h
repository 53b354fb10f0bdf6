// Ray against triangle, watertight: a ray from inside a closed mesh always hits. The triangle is projected along the
// ray; three edge functions, each two products and one difference, are then exactly antisymmetric in their two
// vertices, so that a shared edge has no gap whatever the rounding. Culling is float; the verdict is double, because a
// float test misplaces t by its rounding divided by the sine of the grazing angle (measured: 0.7 % of random rays were
// off by more than the product allows, some were misses). Where a triangle is so nearly edge-on that double does the
// same, edge_on_triangle.h decides. Source: Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, 2013; here
// without its divisions, so that small whole numbers are judged exactly.
#ifndef LOCUS_CORE_GEOMETRY_RAY_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_RAY_TRIANGLE_H_

#include <optional>

#include "core/geometry/ray.h"
#include "core/geometry/stored_ray.h"
#include "core/geometry/transform.h"
#include "core/geometry/triangle.h"

namespace locus {

struct TriangleHit {
  float t;
  float u, v;  // weights of the second and the third vertex
};

// A ray in mesh axes, ready for slab tests in float and triangle tests in double. The direction is scaled by a power of
// two so that its largest component lies in [0.5, 1): no later product over- or underflows; t here counts in the scaled
// direction. Immutable; cheap to copy.
class TriangleRay {
 public:
  // `origin` and `direction` in mesh axes. The slab test rounds each component to float once, which its pad covers.
  TriangleRay(Vec3d origin, Vec3d direction, Cull cull = Cull::kNone);
  // In world axes, for a mesh that stands so. Rounded to mesh axes; what that changes for triangles nearly edge-on is
  // made good.
  TriangleRay(const Transform& transform, Vec3d origin, Vec3d direction, Cull cull = Cull::kNone);

  const SlabRay<float>& slabs() const { return slabs_; }
  Cull cull() const { return cull_; }

  // t in units of the given direction, from and to t in units of the scaled one. Rounding is monotone; from_scaled()
  // never gives more than the largest finite float for a finite t; to_scaled() rounds up, so that a limit given to a
  // culling test never excludes what from_scaled() would have rounded down to it.
  float from_scaled(float t) const;
  float to_scaled(float t) const;

  // The verdict, a pure function of ray and triangle: the watertight test accepts with t >= 0 (scaled units; t is 0
  // where the origin lies on the triangle within the rounding of the test), and so does the slab test of the triangle's
  // own box; t is clamped to the box's interval, so that no tree can prune what a list reports. Exactly edge-on and
  // zero-area triangles are never hit. No hit is off by more than 2^-21 of its own coordinates and the origin's.
  std::optional<TriangleHit> hit(const Triangle& triangle) const;

 private:
  struct Seen;

  TriangleRay(const StoredRay& stored, Vec3d origin, Vec3d direction, Cull cull);

  Seen see(const Triangle& triangle) const;
  std::optional<TriangleHit> edge_test(const Triangle& triangle) const;
  bool is_exactly_edge_on(const Triangle& triangle) const;
  std::optional<TriangleHit> edge_on_test(const Triangle& triangle, const Seen& seen) const;
  double depth_noise(const Triangle& triangle) const;

  StoredRay stored_;
  int exponent_;  // given direction = scaled direction * 2^exponent
  Vec3d origin_, direction_;
  double start_;  // the largest |component| of the origin
  SlabRay<float> slabs_;
  Cull cull_;
  int axis_x_, axis_y_, axis_z_;  // z is the largest component of the direction
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_TRIANGLE_H_
