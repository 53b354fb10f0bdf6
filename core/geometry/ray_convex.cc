#include "core/geometry/ray_convex.h"

#include <limits>

#include "core/base/check.h"
#include "core/geometry/segment.h"

namespace locus {
namespace {

using Range = std::optional<Interval<double>>;

// Returns the interval of the line between the two planes that end the cylinder: perpendicular to its axis, through the
// ends of the axis.
Range line_between_ends(const Line& line, Vec3d half_axis) {
  const double aa = squared_length(half_axis);
  const double o = dot(line.origin, half_axis);
  const double d = dot(line.direction, half_axis);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (d == 0) return std::abs(o) <= aa ? Range({-kInfinity, kInfinity}) : std::nullopt;
  return d > 0 ? Range({(-aa - o) / d, (aa - o) / d}) : Range({(aa - o) / d, (-aa - o) / d});
}

// Returns the interval of the line in the cylinder between the capsule's end balls. |p x half_axis| is the distance of
// a point p from the axis times |half_axis|, so line_in_ball() of the cross products gives the interval; no division by
// |half_axis| is needed.
Range line_in_cylinder(const Line& line, Vec3d half_axis, double radius) {
  const Line across = {cross(line.origin, half_axis), cross(line.direction, half_axis)};
  const Range round = line_in_ball(across, radius * radius * squared_length(half_axis));
  const Range between = line_between_ends(line, half_axis);
  if (!round || !between) return std::nullopt;
  const Interval<double> both = {std::max(round->near, between->near), std::min(round->far, between->far)};
  return both.near <= both.far ? Range(both) : std::nullopt;
}

// Returns the smallest interval that contains `a` and `b`; nullopt is the empty interval.
Range merge(const Range& a, const Range& b) {
  if (!a || !b) return a ? a : b;
  return Range({std::min(a->near, b->near), std::max(a->far, b->far)});
}

// Returns the unit vector of `axis` with the sign of `sign`.
Vec3d axis_normal(int axis, double sign) {
  Vec3d normal;
  normal[axis] = sign < 0 ? -1 : 1;
  return normal;
}

}  // namespace

std::optional<Interval<double>> line_in_ball(const Line& line, double squared_radius) {
  const double dd = squared_length(line.direction);
  if (dd == 0) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (squared_length(line.origin) <= squared_radius) return Interval<double>{-kInfinity, kInfinity};
    return std::nullopt;
  }
  const double rest = squared_radius * dd - squared_length(cross(line.origin, line.direction));
  if (!(rest >= 0)) return std::nullopt;
  const double middle = -dot(line.origin, line.direction);
  const double half = std::sqrt(rest);
  return Interval<double>{(middle - half) / dd, (middle + half) / dd};
}

std::optional<Chord> chord_of_ball(const Line& line, double radius) {
  LOCUS_DCHECK_GE(radius, 0.0);
  const std::optional<Interval<double>> t = line_in_ball(line, radius * radius);
  if (!t) return std::nullopt;
  if (radius == 0) return Chord{t->near, t->far, -line.direction, line.direction};
  return Chord{t->near, t->far, line.origin + line.direction * t->near, line.origin + line.direction * t->far};
}

bool ball_contains(double radius, Vec3d point) { return squared_length(point) <= radius * radius; }

std::optional<Chord> chord_of_capsule(const Line& line, Vec3d half_axis, double radius) {
  LOCUS_DCHECK_GE(radius, 0.0);
  const double rr = radius * radius;
  Range range = merge(line_in_ball({line.origin - half_axis, line.direction}, rr),
                      line_in_ball({line.origin + half_axis, line.direction}, rr));
  if (half_axis != Vec3d{}) range = merge(range, line_in_cylinder(line, half_axis, radius));
  if (!range) return std::nullopt;
  if (radius == 0) return Chord{range->near, range->far, -line.direction, line.direction};
  const Vec3d entry = line.origin + line.direction * range->near;
  const Vec3d exit = line.origin + line.direction * range->far;
  return Chord{range->near, range->far, entry - nearest_on_segment(entry, half_axis),
               exit - nearest_on_segment(exit, half_axis)};
}

bool capsule_contains(Vec3d half_axis, double radius, Vec3d point) {
  return squared_distance_to_segment(point, half_axis) <= radius * radius;
}

std::optional<Chord> chord_of_box(const Line& line, Vec3d half) {
  LOCUS_DCHECK(half.x >= 0 && half.y >= 0 && half.z >= 0);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Chord chord{-kInfinity, kInfinity, -line.direction, line.direction};
  for (int axis = 0; axis < 3; ++axis) {
    const double o = line.origin[axis];
    const double d = line.direction[axis];
    if (d == 0) {
      if (std::abs(o) > half[axis]) return std::nullopt;
      continue;
    }
    const double entry = (d > 0 ? -half[axis] - o : half[axis] - o) / d;
    const double exit = (d > 0 ? half[axis] - o : -half[axis] - o) / d;
    if (entry > chord.near) {
      chord.near = entry;
      chord.near_normal = axis_normal(axis, -d);
    }
    if (exit < chord.far) {
      chord.far = exit;
      chord.far_normal = axis_normal(axis, d);
    }
  }
  if (!(chord.near <= chord.far)) return std::nullopt;
  return chord;
}

bool box_contains(Vec3d half, Vec3d point) {
  return std::abs(point.x) <= half.x && std::abs(point.y) <= half.y && std::abs(point.z) <= half.z;
}

}  // namespace locus
