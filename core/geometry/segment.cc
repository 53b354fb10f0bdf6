#include "core/geometry/segment.h"

#include <array>
#include <limits>

namespace locus {
namespace {

// Returns, for each axis, the signed distance of the coordinate of `point` from the interval [-half, half] of the box;
// 0 if the coordinate is in this interval.
Vec3d gap_to_box(Vec3d point, Vec3d half) {
  Vec3d gap;
  for (int axis = 0; axis < 3; ++axis)
    gap[axis] = point[axis] - std::min(std::max(point[axis], -half[axis]), half[axis]);
  return gap;
}

// Returns the breakpoints of the segment in ascending order. A breakpoint is a value of s, which selects the point
// center + s * half_axis, -1 <= s <= 1. Two breakpoints are -1 and 1, the ends of the segment. The others are, for each
// axis, the two values of s at which the segment crosses the planes of the box's faces, clamped to -1 .. 1. For an axis
// to which the segment is perpendicular, these two values are 1.
std::array<double, 8> breakpoints_of(Vec3d center, Vec3d half_axis, Vec3d half) {
  std::array<double, 8> breakpoints;
  breakpoints.fill(1);
  breakpoints[0] = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = half_axis[axis];
    if (a == 0) continue;
    breakpoints[2 * axis + 2] = std::min(std::max((half[axis] - center[axis]) / a, -1.0), 1.0);
    breakpoints[2 * axis + 1] = std::min(std::max((-half[axis] - center[axis]) / a, -1.0), 1.0);
  }
  std::sort(breakpoints.begin(), breakpoints.end());
  return breakpoints;
}

// Returns the minimum of the squared distance from the box over the values of s between the adjacent breakpoints `from`
// and `to`. In this range the squared distance is a parabola in s: the squared distance of a line from one corner, edge
// or face of the box. Returns infinity if the vertex of the parabola lies outside the range. The minimum is computed by
// a cross product and one division: exact if the result is a small integer.
double min_between(double from, double to, Vec3d center, Vec3d half_axis, Vec3d half) {
  const Vec3d gap = gap_to_box(center + half_axis * (0.5 * (from + to)), half);
  Vec3d base, along;  // the segment's line, restricted to the coordinates that are outside the box
  for (int axis = 0; axis < 3; ++axis) {
    if (gap[axis] == 0) continue;
    base[axis] = center[axis] - std::copysign(half[axis], gap[axis]);
    along[axis] = half_axis[axis];
  }
  const double aa = squared_length(along);
  if (aa == 0) return squared_length(base);
  constexpr double kRounding = 1e-14;  // tolerance: rounding must not exclude a minimum at a breakpoint
  const double s = -dot(base, along) / aa;
  if (s < from - kRounding || s > to + kRounding) return std::numeric_limits<double>::infinity();
  return squared_length(cross(base, along)) / aa;
}

}  // namespace

Vec3d nearest_on_segment(Vec3d point, Vec3d half_axis) {
  const double aa = squared_length(half_axis);
  const double along = dot(point, half_axis);
  if (along >= aa) return half_axis;
  if (along <= -aa) return -half_axis;
  return half_axis * (along / aa);
}

double squared_distance_to_segment(Vec3d point, Vec3d half_axis) {
  const double aa = squared_length(half_axis);
  const double along = dot(point, half_axis);
  if (along >= aa) return squared_length(point - half_axis);
  if (along <= -aa) return squared_length(point + half_axis);
  return squared_length(cross(point, half_axis)) / aa;
}

double squared_distance_segments(Vec3d offset, Vec3d half_axis, Vec3d other_half_axis) {
  double least = std::min(squared_distance_to_segment(offset + other_half_axis, half_axis),
                          squared_distance_to_segment(offset - other_half_axis, half_axis));
  least = std::min(least, squared_distance_to_segment(half_axis - offset, other_half_axis));
  least = std::min(least, squared_distance_to_segment(-half_axis - offset, other_half_axis));
  const Vec3d normal = cross(half_axis, other_half_axis);
  const double nn = squared_length(normal);
  if (nn == 0) return least;
  const double s = dot(cross(offset, other_half_axis), normal) / nn;
  const double t = dot(cross(offset, half_axis), normal) / nn;
  if (std::abs(s) > 1 || std::abs(t) > 1) return least;
  return std::min(least, squared_length(offset + other_half_axis * t - half_axis * s));
}

bool segment_meets_box(Vec3d center, Vec3d half_axis, Vec3d half) {
  const Vec3d a = abs(half_axis);
  const Vec3d across = abs(cross(center, half_axis));
  for (int x = 0; x < 3; ++x) {
    const int y = (x + 1) % 3, z = (x + 2) % 3;
    if (std::abs(center[x]) > half[x] + a[x]) return false;
    if (across[x] > half[y] * a[z] + half[z] * a[y]) return false;
  }
  return true;
}

double squared_distance_segment_box(Vec3d center, Vec3d half_axis, Vec3d half) {
  if (segment_meets_box(center, half_axis, half)) return 0;
  const std::array<double, 8> breakpoints = breakpoints_of(center, half_axis, half);
  double result = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < breakpoints.size(); ++i) {
    result = std::min(result, squared_length(gap_to_box(center + half_axis * breakpoints[i], half)));
    if (i + 1 == breakpoints.size()) break;
    result = std::min(result, min_between(breakpoints[i], breakpoints[i + 1], center, half_axis, half));
  }
  return result;
}

}  // namespace locus
