// The shapes of moving objects and their exact predicates: closed solids in double. Every function is a pure function
// of its arguments: products, sums, divisions and square roots in a fixed order, no fused operation.
#ifndef LOCUS_CORE_GEOMETRY_SHAPE_H_
#define LOCUS_CORE_GEOMETRY_SHAPE_H_

#include <optional>

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/geometry/ray.h"

namespace locus {

enum class ShapeKind : uint8_t { kPoint, kBall, kBox, kCapsule };

// kPoint uses neither `size` nor `radius`; kBall `radius`; kBox `size` as half extents along its axes; kCapsule `size`
// as the half axis (centre to the end of the inner segment, in local axes) and `radius`. `rotation` turns local to
// world.
struct Shape {
  ShapeKind kind = ShapeKind::kPoint;
  Vec3d position;  // centre
  Quaternion rotation;
  Vec3f size;
  float radius = 0;

  friend constexpr bool operator==(const Shape&, const Shape&) = default;
};

// A ray in world axes, ready for slab tests and object predicates in double. Immutable; cheap to copy.
class ObjectRay {
 public:
  explicit ObjectRay(const Rayd& ray, Inside inside = Inside::kSolid)
      : ray_(ray), slabs_(ray, kObjectPad), inside_(inside) {}

  const Rayd& ray() const { return ray_; }
  const SlabRay<double>& slabs() const { return slabs_; }
  Inside inside() const { return inside_; }
  // Distances of the slab test and of hits count in the same unit here.
  double to_scaled(double t) const { return t; }

 private:
  Rayd ray_;
  SlabRay<double> slabs_;
  Inside inside_;
};

struct ShapeHit {
  double t;      // in units of the ray's direction, >= 0
  Vec3d normal;  // unit, outward, world axes; minus the ray's unit direction where the ray starts inside (kSolid)
};

// World axis-aligned bounds, grown by 2^-40 of the magnitudes where rounding could leave part of the shape outside.
Aabbd bounds_of(const Shape& shape);

// First point of the closed solid on the ray, t >= 0, whatever ray.t_max. Points are never hit. Includes the slab test
// of the shape's own bounds, to whose interval t is clamped: no structure can prune what a list reports.
std::optional<ShapeHit> ray_hit(const ObjectRay& ray, const Shape& shape);

// Closed solids share a point: touching counts. Both include the test of the shape's own bounds against the query's.
bool ball_overlaps(const Balld& ball, const Shape& shape);
bool box_overlaps(const Obbd& box, const Shape& shape);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SHAPE_H_
