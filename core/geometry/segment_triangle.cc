#include "core/geometry/segment_triangle.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/double_double.h"
#include "core/geometry/point_triangle.h"
#include "core/geometry/segment.h"

namespace locus {

namespace {

// Error bounds of the volume of a point and a triangle's plane, relative to the product of the largest coordinates.
constexpr double kDoubleError = 0x1p-46;
constexpr double kDoubleDoubleError = 0x1p-96;

Vec3<DoubleDouble> extended(Vec3d a) { return {a.x, a.y, a.z}; }

// Returns whether no two of the three signs are opposite.
bool agree(int first, int second, int third) {
  return (first >= 0 && second >= 0 && third >= 0) || (first <= 0 && second <= 0 && third <= 0);
}

// Same as segment_crosses_triangle() for center 0, in extended precision; false if the segment lies in the plane of the
// triangle.
bool crosses_in_double_double(Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c, double product) {
  const Vec3<DoubleDouble> h = extended(half_axis), pa = extended(a), pb = extended(b), pc = extended(c);
  const Vec3<DoubleDouble> normal = cross(pb + -pa, pc + -pa);
  const DoubleDouble start = dot(normal, pa + h), end = dot(normal, pa + -h);
  const double error = kDoubleDoubleError * product;
  if (std::abs(start.rounded()) <= error && std::abs(end.rounded()) <= error) return false;
  return start.sign() * end.sign() <= 0 &&
         agree(dot(cross(pa, pb), h).sign(), dot(cross(pb, pc), h).sign(), dot(cross(pc, pa), h).sign());
}

}  // namespace

bool segment_crosses_triangle(Vec3d center, Vec3d half_axis, Vec3d a, Vec3d b, Vec3d c) {
  // The corners are taken relative to the midpoint first, so that an edge has the same volume, up to its sign, in both
  // of its triangles.
  const Vec3d pa = a - center, pb = b - center, pc = c - center;
  const double ab = dot(cross(pa, pb), half_axis);
  const double bc = dot(cross(pb, pc), half_axis);
  const double ca = dot(cross(pc, pa), half_axis);
  const bool front = ab >= 0 && bc >= 0 && ca >= 0, back = ab <= 0 && bc <= 0 && ca <= 0;
  if (!front && !back) return false;
  const Vec3d normal = cross(pb - pa, pc - pa);
  const double start = dot(normal, pa + half_axis), end = dot(normal, pa - half_axis);
  // For a segment in the plane of the triangle, or almost, all five signs may be rounding errors, wherever it lies.
  const double product = max_component(abs(pb - pa)) * max_component(abs(pc - pa)) *
                         (max_component(abs(pa)) + max_component(abs(half_axis)));
  if (std::max(std::abs(start), std::abs(end)) <= kDoubleError * product)
    return crosses_in_double_double(half_axis, pa, pb, pc, product);
  return (start <= 0 && end >= 0) || (start >= 0 && end <= 0);
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
