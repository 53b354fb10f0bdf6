// Shapes of moving objects and their exact predicates: closed solids in double. Pure functions: products, sums,
// divisions and square roots in a fixed order, no fused operation. Any thread.
#ifndef LOCUS_CORE_GEOMETRY_SHAPE_H_
#define LOCUS_CORE_GEOMETRY_SHAPE_H_

#include <optional>

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/geometry/ray.h"

namespace locus {

enum class ShapeKind : uint8_t { kPoint, kBall, kBox, kCapsule };

// Shape and its position. kPoint uses neither `size` nor `radius`. kBall uses `radius`. kBox uses `size` as half
// extents along its axes. kCapsule uses `radius` and `size` as the half axis (from the centre to an end of the inner
// segment, in local axes). `rotation` rotates local axes to world axes.
struct Shape {
  ShapeKind kind = ShapeKind::kPoint;
  Vec3d position;  // centre
  Quaternion rotation;
  Vec3f size;
  float radius = 0;

  friend constexpr bool operator==(const Shape&, const Shape&) = default;
};

// Ray in world axes, preprocessed for slab tests and object predicates in double. Immutable; cheap to copy.
class ObjectRay {
 public:
  explicit ObjectRay(const Rayd& ray, Inside inside = Inside::kSolid)
      : ray_(ray), slabs_(ray, kObjectPad), inside_(inside) {}

  const Rayd& ray() const { return ray_; }
  const SlabRay<double>& slabs() const { return slabs_; }
  Inside inside() const { return inside_; }
  // Returns t: slab tests and hits have the same unit here.
  double to_scaled(double t) const { return t; }

 private:
  Rayd ray_;
  SlabRay<double> slabs_;
  Inside inside_;
};

// Hit of a ray on a shape.
struct ShapeHit {
  double t;      // in units of the ray's direction, >= 0
  Vec3d normal;  // unit, outward, world axes; minus the ray's unit direction if the ray starts inside (kSolid)
};

// Returns axis-aligned bounds in world axes, grown by 2^-40 of the magnitudes if rounding could exclude a part of the
// shape.
Aabbd bounds_of(const Shape& shape);

// Returns the first point of the closed solid on the ray with t >= 0, also beyond ray.t_max. Points are never hit. The
// verdict includes the slab test of the shape's own bounds, and t is clamped to their interval, so no structure can
// prune a hit that a list reports.
std::optional<ShapeHit> ray_hit(const ObjectRay& ray, const Shape& shape);

// Return whether the closed solids share a point; touching counts. Both verdicts include the test of the shape's own
// bounds against the query.
bool ball_overlaps(const Balld& ball, const Shape& shape);
bool box_overlaps(const Obbd& box, const Shape& shape);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SHAPE_H_
