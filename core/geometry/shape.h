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
  // Returns `t` unchanged: slab tests and hits have the same unit here.
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

// Returns axis-aligned bounds in world axes. If rounding could exclude a part of the shape, they are grown by 2^-40 of
// the magnitudes.
Aabbd bounds_of(const Shape& shape);

// Returns the hit of the ray on the closed solid with the smallest t >= 0, or as ray.inside() says if the ray starts
// inside. Ignores t_max, so the caller must compare t with its limit. Points are never hit. A hit also requires that
// the slab test accepts the shape's own bounds, and t is clamped to the interval of that test. So an index, which culls
// by boxes, reports the same hits as a list.
std::optional<ShapeHit> ray_hit(const ObjectRay& ray, const Shape& shape);

// Return whether the shape and the query share a point; touching counts. Both also require that the shape's own bounds
// meet the ball, or the bounds of the box. So culling by any superset of the shape's bounds never changes the result.
bool ball_overlaps(const Balld& ball, const Shape& shape);
bool box_overlaps(const Obbd& box, const Shape& shape);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SHAPE_H_
