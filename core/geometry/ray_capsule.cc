#include "core/geometry/ray_capsule.h"

#include "core/base/check.h"
#include "core/geometry/ray_ball.h"
#include "core/geometry/segment.h"

namespace locus {
namespace {

using Range = std::optional<Interval<double>>;

// Returns the interval of the line between the planes through both ends of the axis.
Range line_between_ends(const Line& line, Vec3d half_axis) {
  const double aa = squared_length(half_axis);
  const double o = dot(line.origin, half_axis);
  const double d = dot(line.direction, half_axis);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (d == 0) return std::abs(o) <= aa ? Range({-kInfinity, kInfinity}) : std::nullopt;
  return d > 0 ? Range({(-aa - o) / d, (aa - o) / d}) : Range({(aa - o) / d, (-aa - o) / d});
}

// Returns the interval of the line in the cylinder. |p x half_axis| is the distance of p from the axis times
// |half_axis|, so the test is that of a line against a ball and needs no division.
Range line_in_cylinder(const Line& line, Vec3d half_axis, double radius) {
  const Line across = {cross(line.origin, half_axis), cross(line.direction, half_axis)};
  const Range round = line_in_ball(across, radius * radius * squared_length(half_axis));
  const Range between = line_between_ends(line, half_axis);
  if (!round || !between) return std::nullopt;
  const Interval<double> both = {std::max(round->near, between->near), std::min(round->far, between->far)};
  return both.near <= both.far ? Range(both) : std::nullopt;
}

// Returns the smallest interval that contains both; nullopt counts as empty.
Range merge(const Range& a, const Range& b) {
  if (!a || !b) return a ? a : b;
  return Range({std::min(a->near, b->near), std::max(a->far, b->far)});
}

}  // namespace

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

}  // namespace locus
