#include "core/geometry/sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/box_sweep.h"
#include "core/geometry/round_sweep.h"

namespace locus {
namespace {

bool is_round(const Shape& shape) { return shape.kind == ShapeKind::kBall || shape.kind == ShapeKind::kCapsule; }

// Relative motion of a mover and a shape, at least one of which is round. The segment of the RoundSweep is the mover's
// centre or inner segment; if the mover is a box, the segment is the shape's centre or inner segment.
struct RoundMotion {
  RoundSweep sweep;
  Rotation axes;        // rotates the axes of `sweep` to the axes in which the mover is given
  double shape_radius;  // part of the sweep's radius that belongs to the shape
  bool is_reversed;     // true if the segment belongs to the shape, false if it belongs to the mover
};

RoundMotion round_motion(const Mover& mover, const Shape& shape) {
  const Rotation rotation = shape.kind == ShapeKind::kBall ? Rotation() : rotation_of(shape.rotation);
  const double shape_radius = is_round(shape) ? shape.radius : 0;
  const Vec3d inner = shape.kind == ShapeKind::kCapsule ? rotation.to_world(to_double(shape.size)) : Vec3d{};
  const Vec3d offset = shape.position - mover.start;
  if (mover.kind == MoverKind::kBox) {
    const Rotation& axes = mover.rotation;
    return {RoundSweep::to_box(axes.to_local(inner), shape_radius, axes.to_local(-offset), mover.half,
                               axes.to_local(mover.way)),
            axes, shape_radius, true};
  }
  if (shape.kind == ShapeKind::kBox)
    return {RoundSweep::to_box(rotation.to_local(mover.half_axis), mover.radius, rotation.to_local(offset),
                               to_double(shape.size), rotation.to_local(-mover.way)),
            rotation, 0, false};
  return {RoundSweep::to_segment(mover.half_axis, mover.radius + shape_radius, offset, inner, -mover.way), Rotation(),
          shape_radius, false};
}

Contact contact_of(const RoundMotion& motion, const Mover& mover, const Shape& shape, double t) {
  const RoundSweep::Separation separation = motion.sweep.separation_at(t);
  const Vec3d direction = motion.axes.to_world(separation.direction);
  const Vec3d normal = motion.is_reversed ? -direction : direction;
  const Vec3d core = motion.is_reversed
                         ? shape.position - mover.start + motion.axes.to_world(separation.pair.on_segment)
                         : mover.way * t + motion.axes.to_world(separation.pair.on_primitive);
  const double depth_of_point = std::clamp(separation.distance, 0.0, motion.shape_radius);
  return {separation.distance - motion.shape_radius, core + normal * depth_of_point, normal};
}

// Returns a lower bound of the time of the first contact of a ball or capsule with a triangle: the time at which the
// mover reaches the triangle's plane, or infinity if the mover never reaches this plane. The corners `a`, `b` and `c`
// are relative to the mover's start.
inline double plane_bound(const Mover& mover, Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d ab = b - a, ac = c - a;
  const Vec3d normal = cross(ab, ac);
  // Height of the plane above the mover's centre, and the rate at which the height changes. Each value is multiplied
  // by the length of the normal.
  const double height = dot(normal, a), rate = -dot(normal, mover.way);
  constexpr double kEpsilon = 0x1p-44;  // covers the rounding of the normal and of the heights
  const double size = max_component(max(abs(ab), abs(ac)));
  const double epsilon =
      kEpsilon * size * size *
      (max_component(abs(a) + abs(mover.way)) + size + max_component(abs(mover.half_axis)) + mover.radius);
  const double rest = std::abs(height) - std::abs(dot(normal, mover.half_axis)) - epsilon;
  if (rest <= 0 || rest * rest <= mover.radius * mover.radius * squared_length(normal)) return 0;
  const double approach = height > 0 ? -rate : rate;
  if (!(approach > 0)) return std::numeric_limits<double>::infinity();
  return (rest - mover.radius * std::sqrt(squared_length(normal))) / approach;
}

// Returns whether one of the corners, which are relative to the mover's start, is at most the radius away from the
// mover's centre at the start. The mover then touches the triangle at t = 0.
inline bool touches_corner_at_start(const Mover& mover, const Corners& corners) {
  const double squared = mover.radius * mover.radius * (planted(PlantedBug::kSweepPassed) ? 4 : 1);
  return squared_length(corners[0]) <= squared || squared_length(corners[1]) <= squared ||
         squared_length(corners[2]) <= squared;
}

RoundSweep round_sweep(const Mover& mover, const Corners& corners) {
  return RoundSweep::to_triangle(mover.half_axis, mover.radius, corners[0] - mover.start, corners[1] - mover.start,
                                 corners[2] - mover.start, -mover.way);
}

// Returns the corners relative to the centre of a box at time t, in the box's own axes.
Corners in_box(const Mover& box, const Corners& corners, double t) {
  Corners local;
  for (size_t i = 0; i < local.size(); ++i) local[i] = box.rotation.to_local(corners[i] - box.start - box.way * t);
  return local;
}

std::optional<BoxOverlap> box_overlap(const Mover& box, const Corners& corners) {
  const Corners local = in_box(box, corners, 0);
  return overlap_with_triangle(box.half, local[0], local[1], local[2], box.rotation.to_local(-box.way));
}

// Returns the overlap of a box with a shape that is not round: a box or a point.
std::optional<BoxOverlap> box_overlap(const Mover& box, const Shape& shape) {
  LOCUS_DCHECK(!is_round(shape));
  const Vec3d half = shape.kind == ShapeKind::kBox ? to_double(shape.size) : Vec3d{};
  return overlap_with_box(box.half, box.rotation.to_local(shape.position - box.start), half,
                          compose(inverse(box.rotation), rotation_of(shape.rotation)), box.rotation.to_local(-box.way));
}

// Returns the first moment of `overlap` in 0 .. limit, or nullopt.
std::optional<double> first_moment(const std::optional<BoxOverlap>& overlap, double limit) {
  if (!overlap || overlap->time.far < 0 || !(overlap->time.near <= limit)) return std::nullopt;
  return std::max(overlap->time.near, 0.0);
}

Contact contact_of(const std::optional<BoxOverlap>& overlap, const Mover& box, Vec3d shared, double t) {
  const Vec3d normal = overlap ? box.rotation.to_world(overlap->normal) : Vec3d{0, 0, 1};
  return {overlap ? -overlap->depth : 0, box.way * t + box.rotation.to_world(shared), normal};
}

// Returns `t`, the first moment of contact with `primitive`. Returns nullopt instead if `t` is 0 and `at_start`
// excludes this contact.
template <class Primitive>
std::optional<double> with_rule(std::optional<double> t, const Mover& mover, const Primitive& primitive,
                                AtStart at_start) {
  if (!t || *t > 0 || at_start == AtStart::kHit) return t;
  if (at_start == AtStart::kPass || !(dot(contact_at(mover, primitive, 0).normal, mover.way) < 0)) return std::nullopt;
  return t;
}

}  // namespace

bool misses_along_path(const Mover& mover, const Corners& corners) {
  // Covers the rounding of the products, and the epsilons of RoundSweep at any time of the path.
  const double epsilon = planted(PlantedBug::kSweepLineEpsilon) ? 0 : 0x1p-40;
  const double way = max_component(abs(mover.way));
  const double place = max_component(abs(mover.half_axis)) + mover.radius + way;
  const double radius = planted(PlantedBug::kSweepLineRadius) ? 0 : mover.radius;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3d from = corners[i], edge = corners[(i + 1) % 3] - from, other = corners[(i + 2) % 3];
    // Separating axis, perpendicular to the path and to the edge, and the triangle's interval on it. The mover's
    // interval is centred at 0. All values are multiplied by the length of the axis.
    const Vec3d axis = cross(edge, mover.way);
    const double edge_at = dot(axis, from), other_at = dot(axis, other);
    const double gap = std::max(std::min(edge_at, other_at), -std::max(edge_at, other_at));
    const double size = max_component(max(abs(edge), abs(other - from)));
    const double along_axis = planted(PlantedBug::kSweepLineAxis) ? 0 : std::abs(dot(axis, mover.half_axis));
    const double rest = gap - along_axis - epsilon * size * way * (max_component(abs(from)) + size + place);
    if (rest > 0 && rest * rest > radius * radius * squared_length(axis)) return true;
  }
  return false;
}

Mover mover_to_mesh(const Mover& mover, const Transform& transform) {
  const double inverse_scale = 1.0 / transform.scale;
  Mover result;  // set member by member: copying a mover that was just written in parts would stall the processor
  result.kind = mover.kind;
  result.start = transform.point_to_mesh(mover.start);
  result.way = transform.direction_to_mesh(mover.way);
  result.radius = mover.radius * inverse_scale;
  if (mover.kind == MoverKind::kCapsule) result.half_axis = transform.direction_to_mesh(mover.half_axis);
  if (mover.kind == MoverKind::kBox) {
    result.half = mover.half * inverse_scale;
    result.rotation = compose(inverse(transform.rotation), mover.rotation);
  }
  return result;
}

std::optional<double> first_contact(const Mover& mover, const Shape& shape, AtStart at_start, double limit) {
  const bool is_polytope = mover.kind == MoverKind::kBox && !is_round(shape);
  const std::optional<double> t = is_polytope ? first_moment(box_overlap(mover, shape), limit)
                                              : round_motion(mover, shape).sweep.first_contact(limit);
  return with_rule(t, mover, shape, at_start);
}

std::optional<double> first_contact(const Mover& mover, const Corners& triangle, AtStart at_start, double limit) {
  if (mover.kind == MoverKind::kBox)
    return with_rule(first_moment(box_overlap(mover, triangle), limit), mover, triangle, at_start);
  const Corners corners = {triangle[0] - mover.start, triangle[1] - mover.start, triangle[2] - mover.start};
  if (at_start == AtStart::kPass && touches_corner_at_start(mover, corners)) return std::nullopt;
  const double from = plane_bound(mover, corners[0], corners[1], corners[2]);
  if (!(from <= limit) || misses_along_path(mover, corners)) return std::nullopt;
  return with_rule(round_sweep(mover, triangle).first_contact(limit, from), mover, triangle, at_start);
}

Contact contact_at(const Mover& mover, const Shape& shape, double t) {
  if (mover.kind != MoverKind::kBox || is_round(shape)) return contact_of(round_motion(mover, shape), mover, shape, t);
  const Vec3d center = mover.rotation.to_local(shape.position - mover.start - mover.way * t);
  const Vec3d half = shape.kind == ShapeKind::kBox ? to_double(shape.size) : Vec3d{};
  const Rotation rotation = compose(inverse(mover.rotation), rotation_of(shape.rotation));
  return contact_of(box_overlap(mover, shape), mover, shared_point(mover.half, center, half, rotation), t);
}

Contact contact_at(const Mover& mover, const Corners& triangle, double t) {
  if (mover.kind == MoverKind::kBox) {
    const Corners local = in_box(mover, triangle, t);
    return contact_of(box_overlap(mover, triangle), mover, shared_point(mover.half, local[0], local[1], local[2]), t);
  }
  const RoundSweep::Separation separation = round_sweep(mover, triangle).separation_at(t);
  return {separation.distance, mover.way * t + separation.pair.on_primitive, separation.direction};
}

}  // namespace locus
