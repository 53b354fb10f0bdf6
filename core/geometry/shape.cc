#include "core/geometry/shape.h"

#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/ray_convex.h"
#include "core/geometry/segment.h"

namespace locus {
namespace {

Obbd box_of(const Shape& shape) { return {shape.position, to_double(shape.size), rotation_of(shape.rotation)}; }

Aabbd capsule_bounds(const Shape& shape) {
  constexpr double kEpsilon = 0x1p-40;
  const Vec3d axis = abs(rotation_of(shape.rotation).to_world(to_double(shape.size)));
  const double epsilon = kEpsilon * (max_component(abs(shape.position)) + max_component(axis) + shape.radius);
  return grown(Aabbd{shape.position - axis, shape.position + axis}, shape.radius + epsilon);
}

// Returns a float that is at least `length`.
float at_least(double length) {
  return std::nextafter(static_cast<float>(length), std::numeric_limits<float>::infinity());
}

// Line of a ray in a solid's own axes.
struct LocalRay {
  Line line;
  int exponent;       // given direction = line direction * 2^exponent, rotated to world
  Rotation rotation;  // rotates the solid's own axes to world axes
};

LocalRay local_ray(const Rayd& ray, const Shape& shape) {
  LocalRay local;
  (void)std::frexp(max_component(abs(ray.direction)), &local.exponent);
  const Vec3d direction = {std::ldexp(ray.direction.x, -local.exponent), std::ldexp(ray.direction.y, -local.exponent),
                           std::ldexp(ray.direction.z, -local.exponent)};
  LOCUS_DCHECK_GE(max_component(abs(direction)), 0.5);
  if (shape.kind != ShapeKind::kBall) local.rotation = rotation_of(shape.rotation);
  local.line = {local.rotation.to_local(ray.origin - shape.position), local.rotation.to_local(direction)};
  return local;
}

bool contains(const Shape& shape, Vec3d local) {
  switch (shape.kind) {
    case ShapeKind::kPoint:
    case ShapeKind::kCompound:
      return false;
    case ShapeKind::kBall:
      return ball_contains(shape.radius, local);
    case ShapeKind::kBox:
      return box_contains(to_double(shape.size), local);
    case ShapeKind::kCapsule:
      return capsule_contains(to_double(shape.size), shape.radius, local);
  }
  return false;
}

std::optional<Chord> chord_of(const Shape& shape, const Line& line) {
  switch (shape.kind) {
    case ShapeKind::kPoint:
    case ShapeKind::kCompound:
      return std::nullopt;
    case ShapeKind::kBall:
      return chord_of_ball(line, shape.radius);
    case ShapeKind::kBox:
      return chord_of_box(line, to_double(shape.size));
    case ShapeKind::kCapsule:
      return chord_of_capsule(line, to_double(shape.size), shape.radius);
  }
  return std::nullopt;
}

ShapeHit hit_at(const LocalRay& local, double t, Vec3d normal) {
  if (normal == Vec3d{}) normal = -local.line.direction;
  return {std::ldexp(std::max(t, 0.0), -local.exponent), normalized(local.rotation.to_world(normal))};
}

// Returns the hit on the solid; ray_hit() adds the test of the solid's bounds.
std::optional<ShapeHit> solid_hit(const ObjectRay& ray, const Shape& shape) {
  const LocalRay local = local_ray(ray.ray(), shape);
  const bool inside = contains(shape, local.line.origin);
  if (inside && ray.inside() == Inside::kSkip) return std::nullopt;
  if (inside && ray.inside() == Inside::kSolid) return ShapeHit{0, Vec3d{} - normalized(ray.ray().direction)};
  const std::optional<Chord> chord = chord_of(shape, local.line);
  // If the ray starts inside and within rounding of the surface, chord_of() may find no chord; the ray then exits at t
  // = 0.
  if (inside) return chord ? hit_at(local, chord->far, chord->far_normal) : hit_at(local, 0, local.line.origin);
  if (!chord || chord->far < 0) return std::nullopt;
  return hit_at(local, chord->near, chord->near_normal);
}

// Returns the radius by which a shape extends beyond its core. The core of a ball is its centre, the core of a capsule
// its inner segment. A box or a point is its own core, with a radius of 0.
double core_radius(const Shape& shape) {
  LOCUS_DCHECK(shape.radius >= 0 || shape.kind == ShapeKind::kPoint || shape.kind == ShapeKind::kBox);
  return shape.kind == ShapeKind::kBall || shape.kind == ShapeKind::kCapsule ? shape.radius : 0;
}

// Returns the squared distance from `point` to the core of the shape; 0 if the core is a box that contains `point`.
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
    case ShapeKind::kCompound:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

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
    case ShapeKind::kCompound:
      break;
  }
  return {};
}

// Returns max(a, sqrt(b)). Avoids the square root if `a` exceeds sqrt(b) by more than rounding errors.
double max_with_root(double a, double b) { return a > 0 && a * a > b * (1 + 0x1p-50) ? a : std::max(a, std::sqrt(b)); }

}  // namespace

float extent_of(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::kPoint:
    case ShapeKind::kCompound:
      return 0;
    case ShapeKind::kBall:
      return shape.radius;
    case ShapeKind::kBox:
      return at_least(std::sqrt(squared_length(to_double(shape.size))));
    case ShapeKind::kCapsule:
      return at_least(std::sqrt(squared_length(to_double(shape.size))) + shape.radius);
  }
  return 0;
}

Aabbd bounds_of(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::kPoint:
      return {shape.position, shape.position};
    case ShapeKind::kBall:
      return bounds_of(Balld{shape.position, shape.radius});
    case ShapeKind::kBox:
      return bounds_of(box_of(shape));
    case ShapeKind::kCapsule:
      return capsule_bounds(shape);
    case ShapeKind::kCompound:
      LOCUS_DCHECK(shape.kind != ShapeKind::kCompound);
  }
  return {};
}

std::optional<ShapeHit> ray_hit(const ObjectRay& ray, const Shape& shape) {
  if (shape.kind == ShapeKind::kPoint) return std::nullopt;
  const Interval<double> own = ray.slabs().interval(bounds_of(shape));
  if (!(own.near <= own.far) || own.far < 0) return std::nullopt;
  std::optional<ShapeHit> hit = solid_hit(ray, shape);
  if (hit) hit->t = std::max(std::min(std::max(hit->t, own.near), own.far), 0.0);
  return hit;
}

bool ball_overlaps(const Balld& ball, const Shape& shape) {
  const double radius_sum = ball.radius + core_radius(shape);
  const double distance = squared_distance_to_core(ball.center, shape);
  const bool meets =
      planted(PlantedBug::kStrictTie) ? distance < radius_sum * radius_sum : distance <= radius_sum * radius_sum;
  if (!meets) return false;
  // Fast path: a ball or point whose distance is less than radius_sum by more than rounding errors needs no reaches()
  // test, since its bounds are never farther away than the shape itself.
  const bool is_round = shape.kind == ShapeKind::kBall || shape.kind == ShapeKind::kPoint;
  if (is_round && distance < radius_sum * radius_sum * (1 - 0x1p-38) && radius_sum > 0x1p-256) return true;
  return reaches(ball, bounds_of(shape));
}

bool box_overlaps(const Obbd& box, const Shape& shape) {
  if (!overlaps(bounds_of(box), bounds_of(shape))) return false;
  const Vec3d offset = box.rotation.to_local(shape.position - box.center);
  const double rr = double{shape.radius} * shape.radius;
  switch (shape.kind) {
    case ShapeKind::kPoint:
      return box_contains(box.half, offset);
    case ShapeKind::kBall:
      return squared_distance(offset, Aabbd{-box.half, box.half}) <= rr;
    case ShapeKind::kBox:
      return boxes_overlap(box, box_of(shape));
    case ShapeKind::kCapsule: {
      const Vec3d half_axis = rotation_of(shape.rotation).to_world(to_double(shape.size));
      return squared_distance_segment_box(offset, box.rotation.to_local(half_axis), box.half) <= rr;
    }
    case ShapeKind::kCompound:
      break;
  }
  return false;
}

double distance(Vec3d point, const Shape& shape) {
  if (shape.kind == ShapeKind::kBall) {  // Fast path with the same result as the general code below.
    const double core_distance = std::sqrt(squared_length(point - shape.position));
    return max_with_root(core_distance - shape.radius,
                         squared_distance(point, bounds_of(Balld{shape.position, shape.radius})));
  }
  const double core_distance = std::sqrt(squared_distance_to_core(point, shape));
  if (shape.kind == ShapeKind::kPoint) return core_distance;  // the bounds of a point are the point itself
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
