#include "core/geometry/segment_triangle.h"

#include <algorithm>

#include "core/geometry/point_triangle.h"
#include "core/geometry/segment.h"

namespace locus {

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
  if (start == 0 && end == 0) return false;  // in the plane: the distances to the edges detect a contact
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
