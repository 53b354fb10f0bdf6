// Shapes of moving objects and their exact predicates: closed solids in double. Pure functions of products, sums,
// divisions and square roots in a fixed order, without fused multiply-add. Any thread.
#ifndef LOCUS_CORE_GEOMETRY_SHAPE_H_
#define LOCUS_CORE_GEOMETRY_SHAPE_H_

#include <optional>

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/geometry/ray.h"

namespace locus {

// Kind of a shape. Only objects are of kind kCompound: their shape has a position and a rotation, and the shapes of
// their parts are computed from these (compound.h). The functions of this file do not take shapes of this kind.
enum class ShapeKind : uint8_t { kPoint, kBall, kBox, kCapsule, kCompound };

// Shape and its position. kPoint uses neither `size` nor `radius`. kBall uses `radius`. kBox uses `size` as its half
// extents, in local axes. kCapsule uses `radius`, and `size` as its half axis, in local axes: the vector from the
// centre to an end of the inner segment. `rotation` rotates local axes to world axes.
struct Shape {
  ShapeKind kind = ShapeKind::kPoint;
  Vec3d position;  // centre of the shape
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
  // Returns `t` unchanged, because slab tests and hits of objects use the same unit of t.
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

// Returns the extent of the shape: an upper bound of the distance from its position to any of its points, under any
// rotation. The extent does not depend on the current rotation. The extent of a ball is exactly its radius.
float extent_of(const Shape& shape);

// Returns axis-aligned bounds in world axes. If rounding could exclude a part of the shape, the bounds are grown by
// 2^-40 of the sum of the magnitudes of position, size and radius.
Aabbd bounds_of(const Shape& shape);

// Returns the hit of the ray on the closed solid with the smallest t >= 0. If the ray starts inside the solid,
// ray.inside() selects the result. Ignores the ray's t_max, so the caller must compare t with t_max. Points are never
// hit. A hit also requires that the slab test accepts the shape's own bounds, and t is clamped to the interval of that
// test. So an index, which culls by boxes, reports the same hits as a test of every shape.
std::optional<ShapeHit> ray_hit(const ObjectRay& ray, const Shape& shape);

// Return whether the shape shares a point with the ball or the box; touching counts. ball_overlaps() also requires that
// the ball reaches() the shape's own bounds. box_overlaps() also requires that the bounds of the box overlap the
// shape's own bounds. So culling by any superset of the shape's bounds never changes the result.
bool ball_overlaps(const Balld& ball, const Shape& shape);
bool box_overlaps(const Obbd& box, const Shape& shape);

// Returns the distance from `point` to the shape; 0 if the shape contains `point`. The result is never less than the
// distance to the shape's own bounds, so a shape may be culled by any box that contains these bounds.
double distance(Vec3d point, const Shape& shape);

// Returns the point of the solid nearest to `point`, up to rounding. If the solid contains `point`, returns `point`.
Vec3d nearest_on_shape(Vec3d point, const Shape& shape);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SHAPE_H_
