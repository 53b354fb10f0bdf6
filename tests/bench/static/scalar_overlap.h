// What peers that only cull are given to decide by: plain float tests of one triangle, as one would write them beside
// such a library. Faster than core/geometry's in double, and now and then wrong by a rounding; static_suite settles
// that. Inline, since each peer's file is compiled on its own.
#ifndef LOCUS_TESTS_BENCH_STATIC_SCALAR_OVERLAP_H_
#define LOCUS_TESTS_BENCH_STATIC_SCALAR_OVERLAP_H_

#include <algorithm>
#include <cmath>

#include "core/geometry/triangle.h"

namespace locus::bench {

// Squared length of `to_point` less s times one edge and t times the other: to a point of the triangle.
inline float squared_distance_at(Vec3f to_point, Vec3f ab, Vec3f ac, float s, float t) {
  return squared_length(to_point - ab * s - ac * t);
}

// Source: Ericson, Real-Time Collision Detection, 2005, section 5.1.5 (regions of the nearest point).
inline float scalar_squared_distance(Vec3f point, const Triangle& triangle) {
  const Vec3f ab = triangle.b - triangle.a, ac = triangle.c - triangle.a, ap = point - triangle.a;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return squared_distance_at(ap, ab, ac, 0, 0);
  const Vec3f bp = point - triangle.b;
  const float d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return squared_distance_at(ap, ab, ac, 1, 0);
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return squared_distance_at(ap, ab, ac, d1 / (d1 - d3), 0);
  const Vec3f cp = point - triangle.c;
  const float d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return squared_distance_at(ap, ab, ac, 0, 1);
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return squared_distance_at(ap, ab, ac, 0, d2 / (d2 - d6));
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return squared_distance_at(ap, ab, ac, 1 - w, w);
  }
  const float whole = 1 / (va + vb + vc);
  return squared_distance_at(ap, ab, ac, vb * whole, vc * whole);
}

// Whether the axis edge x unit vector of `axis` separates: `v` are the vertices from the box's centre.
inline bool edge_separates(const Vec3f (&v)[3], Vec3f edge, Vec3f half, int axis) {
  const int next = (axis + 1) % 3, last = (axis + 2) % 3;
  const float from_next = -edge[last], from_last = edge[next];
  const float p0 = from_next * v[0][next] + from_last * v[0][last];
  const float p1 = from_next * v[1][next] + from_last * v[1][last];
  const float p2 = from_next * v[2][next] + from_last * v[2][last];
  const float reach = half[next] * std::fabs(from_next) + half[last] * std::fabs(from_last);
  return std::min(p0, std::min(p1, p2)) > reach || std::max(p0, std::max(p1, p2)) < -reach;
}

// Source: Akenine-Moller, Fast 3D Triangle-Box Overlap Testing, 2001: three axes of the box, the normal, nine products.
inline bool scalar_box_overlaps(Vec3f centre, Vec3f half, const Triangle& triangle) {
  const Vec3f v[3] = {triangle.a - centre, triangle.b - centre, triangle.c - centre};
  const Vec3f low = min(min(v[0], v[1]), v[2]), high = max(max(v[0], v[1]), v[2]);
  if (low.x > half.x || low.y > half.y || low.z > half.z) return false;
  if (high.x < -half.x || high.y < -half.y || high.z < -half.z) return false;
  const Vec3f edges[3] = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  const Vec3f normal = cross(edges[0], edges[1]);
  const float reach = half.x * std::fabs(normal.x) + half.y * std::fabs(normal.y) + half.z * std::fabs(normal.z);
  if (std::fabs(dot(normal, v[0])) > reach) return false;
  for (const Vec3f& edge : edges)
    for (int axis = 0; axis < 3; ++axis)
      if (edge_separates(v, edge, half, axis)) return false;
  return true;
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_SCALAR_OVERLAP_H_
