#include "core/geometry/point_shape.h"

#include "core/base/check.h"
#include "core/geometry/segment.h"

namespace locus {
namespace {

// Returns the point of the core nearest to `local`, in the shape's own axes.
Vec3d nearest_in_core(Vec3d local, const Shape& shape) {
  const Vec3d size = to_double(shape.size);
  switch (shape.kind) {
    case ShapeKind::kPoint:
    case ShapeKind::kBall:
      return {};
    case ShapeKind::kBox:
      return nearest_in(local, Aabbd{-size, size});
    case ShapeKind::kCapsule:
      return nearest_on_segment(local, size);
  }
  return {};
}

// Returns max(a, sqrt(b)). Avoids the square root if `a` is clearly the larger one.
double max_with_root(double a, double b) { return a > 0 && a * a > b * (1 + 0x1p-50) ? a : std::max(a, std::sqrt(b)); }

}  // namespace

double core_radius(const Shape& shape) {
  LOCUS_DCHECK(shape.radius >= 0 || shape.kind == ShapeKind::kPoint || shape.kind == ShapeKind::kBox);
  return shape.kind == ShapeKind::kBall || shape.kind == ShapeKind::kCapsule ? shape.radius : 0;
}

double squared_distance_to_core(Vec3d point, const Shape& shape) {
  const Vec3d offset = point - shape.position;
  const Vec3d size = to_double(shape.size);
  switch (shape.kind) {
    case ShapeKind::kPoint:
    case ShapeKind::kBall:
      return squared_length(offset);
    case ShapeKind::kBox:
      return squared_distance(rotation_of(shape.rotation).to_local(offset), Aabbd{-size, size});
    case ShapeKind::kCapsule:
      return squared_distance_to_segment(rotation_of(shape.rotation).to_local(offset), size);
  }
  return std::numeric_limits<double>::infinity();
}

double distance(Vec3d point, const Shape& shape) {
  if (shape.kind == ShapeKind::kBall) {  // Fast path: same result as below.
    const double core_distance = std::sqrt(squared_length(point - shape.position));
    return max_with_root(core_distance - shape.radius,
                         squared_distance(point, bounds_of(Balld{shape.position, shape.radius})));
  }
  const double core_distance = std::sqrt(squared_distance_to_core(point, shape));
  if (shape.kind == ShapeKind::kPoint) return core_distance;  // equals the distance to its bounds
  return max_with_root(core_distance - core_radius(shape), squared_distance(point, bounds_of(shape)));
}

Vec3d nearest_on_shape(Vec3d point, const Shape& shape) {
  const double core_distance = std::sqrt(squared_distance_to_core(point, shape));
  const double radius = core_radius(shape);
  if (core_distance <= radius) return point;
  const Rotation rotation = shape.kind == ShapeKind::kBall ? Rotation{} : rotation_of(shape.rotation);
  const Vec3d local = rotation.to_local(point - shape.position);
  const Vec3d from = nearest_in_core(local, shape);
  return shape.position + rotation.to_world(from + (local - from) * (radius / core_distance));
}

}  // namespace locus
