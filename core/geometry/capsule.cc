#include "core/geometry/capsule.h"

#include <cmath>

#include "core/base/planted_bug.h"
#include "core/geometry/segment.h"
#include "core/geometry/segment_triangle.h"

namespace locus {
namespace {

constexpr double kEpsilon = 0x1p-40;

// Box given by its centre and half extents. Covers the box from which it was computed, up to rounding.
struct CenteredBox {
  Vec3d center, half;
};

CenteredBox centered(const Aabbd& box) {
  const Vec3d center = (box.min + box.max) * 0.5;
  return {center, max(box.max - center, center - box.min)};
}

// Returns a length that covers the rounding of the coordinates of capsule and box.
double epsilon_of(const Capsule& capsule, const Aabbd& box) {
  return kEpsilon *
         (max_component(abs(capsule.center)) + max_component(abs(capsule.half_axis)) + capsule.radius + magnitude(box));
}

// Returns the half axis of the capsule, or a wrong half axis if a planted bug is switched on.
Vec3d half_axis_of(const Capsule& capsule) {
  if (planted(PlantedBug::kEndlessCapsule)) return capsule.half_axis * 1e3;
  if (!planted(PlantedBug::kCapsuleCap)) return capsule.half_axis;
  const double length = std::sqrt(squared_length(capsule.half_axis));
  return capsule.half_axis * (length > capsule.radius ? 1 - capsule.radius / length : 0);
}

// Returns the squared distance from the capsule's inner segment to the core of the shape: the centre of a ball, the
// inner segment of a capsule, and for other shapes the shape itself.
double squared_distance_to_core(const Capsule& capsule, const Shape& shape) {
  const Vec3d offset = shape.position - capsule.center;
  const Vec3d size = to_double(shape.size), half_axis = half_axis_of(capsule);
  switch (shape.kind) {
    case ShapeKind::kPoint:
    case ShapeKind::kBall:
      return squared_distance_to_segment(offset, half_axis);
    case ShapeKind::kBox: {
      const Rotation rotation = rotation_of(shape.rotation);
      return squared_distance_segment_box(rotation.to_local(-offset), rotation.to_local(half_axis), size);
    }
    case ShapeKind::kCapsule:
      return squared_distance_segments(offset, half_axis, rotation_of(shape.rotation).to_world(size));
    case ShapeKind::kCompound:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

Aabbd bounds_of(const Capsule& capsule) {
  LOCUS_DCHECK_GE(capsule.radius, 0.0);
  const Vec3d axis = abs(capsule.half_axis);
  const double epsilon = kEpsilon * (max_component(abs(capsule.center)) + max_component(axis) + capsule.radius);
  return grown(Aabbd{capsule.center - axis, capsule.center + axis}, capsule.radius + epsilon);
}

bool reaches(const Capsule& capsule, const Aabbd& box) {
  if (!overlaps(bounds_of(capsule), box)) return false;
  const CenteredBox centered_box = centered(box);
  const double radius = capsule.radius + epsilon_of(capsule, box);
  return squared_distance_segment_box(capsule.center - centered_box.center, capsule.half_axis, centered_box.half) <=
         radius * radius;
}

bool may_reach(const Capsule& capsule, const Aabbd& box) {
  const CenteredBox centered_box = centered(box);
  const double by = capsule.radius + 2 * epsilon_of(capsule, box);
  return segment_meets_box(capsule.center - centered_box.center, capsule.half_axis,
                           centered_box.half + Vec3d{by, by, by});
}

bool capsule_overlaps(const Capsule& capsule, const Shape& shape) {
  const bool is_round = shape.kind == ShapeKind::kBall || shape.kind == ShapeKind::kCapsule;
  const double radius_sum = capsule.radius + (is_round ? shape.radius : 0);
  const double squared = squared_distance_to_core(capsule, shape);
  const bool meets =
      planted(PlantedBug::kStrictTie) ? squared < radius_sum * radius_sum : squared <= radius_sum * radius_sum;
  return meets && reaches(capsule, bounds_of(shape));
}

bool capsule_overlaps(const Capsule& capsule, const Triangle& triangle) {
  if (!overlaps(bounds_of(capsule), to_double(bounds_of(triangle)))) return false;
  const double squared = squared_distance_segment_triangle(capsule.center, half_axis_of(capsule), to_double(triangle.a),
                                                           to_double(triangle.b), to_double(triangle.c));
  const double limit = capsule.radius * capsule.radius;
  return planted(PlantedBug::kStrictTie) ? squared < limit : squared <= limit;
}

}  // namespace locus
