#include "core/geometry/segment_triangle.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/double_double.h"
#include "core/geometry/point_triangle.h"
#include "core/geometry/segment.h"

namespace locus {

namespace {

// Error bounds of a volume, relative to the product of the largest coordinates of its three vectors.
constexpr double kDoubleError = 0x1p-46;
constexpr double kDoubleDoubleError = 0x1p-96;

Vec3<DoubleDouble> extended(Vec3d a) { return {a.x, a.y, a.z}; }

// Returns the sign of a volume, 0 if it may be a rounding error.
int sign_of(DoubleDouble volume, double product) {
  return std::abs(volume.rounded()) <= kDoubleDoubleError * product ? 0 : volume.sign();
}

// Returns the sign of the volume of the edge from `a` to `b` and `half_axis`: on which side of the line through 0 along
// `half_axis` the edge passes. In extended precision if double leaves doubt. The sign for the edge from `b` to `a` is
// exactly the opposite, whatever the third corner of the triangle.
int edge_sign(Vec3d a, Vec3d b, Vec3d half_axis) {
  const double volume = dot(cross(a, b), half_axis);
  const double product = max_component(abs(a)) * max_component(abs(b)) * max_component(abs(half_axis));
  if (std::abs(volume) > kDoubleError * product) return volume > 0 ? 1 : -1;
  return sign_of(dot(cross(extended(a), extended(b)), extended(half_axis)), product);
}

// Returns whether the ends half_axis and -half_axis lie on different sides of the triangle's plane; one of them may lie
// in the plane, but not both.
bool ends_on_both_sides(Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d first = b - a, second = c - a, normal = cross(first, second);
  const double start = dot(normal, a + half_axis), end = dot(normal, a - half_axis);
  const double product =
      max_component(abs(first)) * max_component(abs(second)) * (max_component(abs(a)) + max_component(abs(half_axis)));
  if (std::max(std::abs(start), std::abs(end)) > kDoubleError * product)
    return (start <= 0 && end >= 0) || (start >= 0 && end <= 0);
  const Vec3<DoubleDouble> corner = extended(a), axis = extended(half_axis);
  const Vec3<DoubleDouble> exact_normal = cross(extended(b) + -corner, extended(c) + -corner);
  const int start_sign = sign_of(dot(exact_normal, corner + axis), product);
  const int end_sign = sign_of(dot(exact_normal, corner + -axis), product);
  return start_sign * end_sign <= 0 && (start_sign != 0 || end_sign != 0);
}

}  // namespace

bool segment_crosses_triangle(Vec3d center, Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c) {
  // The corners are taken relative to the midpoint first, so that an edge has the same sign, up to its direction, in
  // both of its triangles.
  const Vec3d pa = a - center, pb = b - center, pc = c - center;
  const int ab = edge_sign(pa, pb, half_axis), bc = edge_sign(pb, pc, half_axis), ca = edge_sign(pc, pa, half_axis);
  const bool front = ab >= 0 && bc >= 0 && ca >= 0, back = ab <= 0 && bc <= 0 && ca <= 0;
  // For a segment in the plane, the distances to the edges detect a contact.
  return (front || back) && ends_on_both_sides(half_axis, pa, pb, pc);
}

double squared_distance_segment_triangle(Vec3d center, Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c) {
  if (segment_crosses_triangle(center, half_axis, a, b, c)) return 0;
  const Vec3d pa = a - center, pb = b - center, pc = c - center;
  double least = std::min(squared_distance(half_axis, pa, pb, pc), squared_distance(-half_axis, pa, pb, pc));
  for (const auto& [from, to] : {std::pair{pa, pb}, std::pair{pb, pc}, std::pair{pc, pa}})
    least = std::min(least, squared_distance_segments((from + to) * 0.5, half_axis, (to - from) * 0.5));
  return least;
}

}  // namespace locus
