#include "core/geometry/nearest_pair.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/geometry/aabb.h"
#include "core/geometry/point_triangle.h"
#include "core/geometry/segment.h"
#include "core/geometry/segment_triangle.h"

namespace locus {
namespace {

NearestPair pair_of(Vec3d on_segment, Vec3d on_primitive) {
  return {squared_length(on_segment - on_primitive), on_segment, on_primitive};
}

void keep_nearer(const NearestPair& candidate, NearestPair& best) {
  if (candidate.squared_distance < best.squared_distance) best = candidate;
}

// Returns the common point of the segment and a triangle that the segment crosses.
Vec3d crossing_of(Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d normal = cross(b - a, c - a);
  const double along = dot(normal, half_axis);
  if (along == 0) return {};
  return half_axis * std::clamp(dot(normal, a) / along, -1.0, 1.0);
}

}  // namespace

NearestPair nearest_to_segment(Vec3d half_axis, Vec3d center, Vec3d other_half_axis) {
  NearestPair best;
  for (const double end : {1.0, -1.0}) {
    const Vec3d other_end = center + other_half_axis * end;
    keep_nearer(pair_of(nearest_on_segment(other_end, half_axis), other_end), best);
  }
  if (half_axis == Vec3d{}) {
    keep_nearer(pair_of({}, center + nearest_on_segment(-center, other_half_axis)), best);
    return best;
  }
  for (const double sign : {1.0, -1.0}) {
    const Vec3d end = half_axis * sign;
    keep_nearer(pair_of(end, center + nearest_on_segment(end - center, other_half_axis)), best);
  }
  const Vec3d normal = cross(half_axis, other_half_axis);
  const double nn = squared_length(normal);
  if (nn == 0) return best;
  const double s = dot(cross(center, other_half_axis), normal) / nn;
  const double t = dot(cross(center, half_axis), normal) / nn;
  if (std::abs(s) <= 1 && std::abs(t) <= 1) keep_nearer(pair_of(half_axis * s, center + other_half_axis * t), best);
  return best;
}

NearestPair nearest_to_triangle(Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c) {
  if (half_axis == Vec3d{}) return pair_of({}, nearest_on_triangle({}, a, b, c));
  if (segment_crosses_triangle({}, half_axis, a, b, c)) {
    const Vec3d common = crossing_of(half_axis, a, b, c);
    return {0, common, common};
  }
  NearestPair best;
  for (const double sign : {1.0, -1.0}) {
    const Vec3d end = half_axis * sign;
    keep_nearer(pair_of(end, nearest_on_triangle(end, a, b, c)), best);
  }
  for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}})
    keep_nearer(nearest_to_segment(half_axis, (from + to) * 0.5, (to - from) * 0.5), best);
  return best;
}

NearestPair nearest_to_box(Vec3d half_axis, Vec3d center, Vec3d half) {
  const Aabbd box{center - half, center + half};
  if (half_axis == Vec3d{}) return pair_of({}, nearest_in({}, box));
  // Values of s at which the segment crosses the planes of the box's faces, and the segment's ends.
  std::array<double, 8> breakpoints;
  breakpoints.fill(1);
  breakpoints[0] = -1;
  for (int axis = 0; axis < 3; ++axis) {
    if (half_axis[axis] == 0) continue;
    breakpoints[2 * axis + 1] = std::clamp(box.min[axis] / half_axis[axis], -1.0, 1.0);
    breakpoints[2 * axis + 2] = std::clamp(box.max[axis] / half_axis[axis], -1.0, 1.0);
  }
  std::sort(breakpoints.begin(), breakpoints.end());
  NearestPair best;
  const auto offer = [&](double s) {
    const Vec3d point = half_axis * s;
    keep_nearer(pair_of(point, nearest_in(point, box)), best);
  };
  for (size_t i = 0; i < breakpoints.size(); ++i) {
    offer(breakpoints[i]);
    if (i + 1 == breakpoints.size() || breakpoints[i] == breakpoints[i + 1]) continue;
    // Between two breakpoints the squared distance is a parabola in s, to which only coordinates outside of the box
    // contribute.
    const Vec3d middle = half_axis * (0.5 * (breakpoints[i] + breakpoints[i + 1]));
    const Vec3d nearest = nearest_in(middle, box);
    double slope = 0, curvature = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (middle[axis] == nearest[axis]) continue;
      slope += half_axis[axis] * nearest[axis];
      curvature += half_axis[axis] * half_axis[axis];
    }
    if (curvature == 0) {
      offer(0.5 * (breakpoints[i] + breakpoints[i + 1]));
      continue;
    }
    const double s = slope / curvature;
    if (s > breakpoints[i] && s < breakpoints[i + 1]) offer(s);
  }
  return best;
}

}  // namespace locus
