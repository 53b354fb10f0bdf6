// Tests of one triangle for peers that only cull by boxes: plain float code, as a user of such a library would write
// it. Faster than the tests of core/geometry in double, and sometimes wrong by a rounding, which agreement.h tolerates.
// Inline, since each peer's file is compiled on its own.
#ifndef LOCUS_TESTS_BENCH_STATIC_SCALAR_OVERLAP_H_
#define LOCUS_TESTS_BENCH_STATIC_SCALAR_OVERLAP_H_

#include <algorithm>
#include <cmath>

#include "core/geometry/triangle.h"

namespace locus::bench {

// Returns the squared length of `to_point` - s `ab` - t `ac`: the squared distance of the query point to a point of the
// triangle.
inline float squared_distance_at(Vec3f to_point, Vec3f ab, Vec3f ac, float s, float t) {
  return squared_length(to_point - ab * s - ac * t);
}

// Returns the squared distance of a point to a triangle. Source: Ericson, Real-Time Collision Detection, 2005, section
// 5.1.5 (regions of the nearest point).
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

// Returns whether an axis separates the triangle from the box. `p0`, `p1`, `p2` are projections of the vertices on the
// axis, relative to the box's centre; `reach` is half the length of the box's projection.
inline bool separates(float p0, float p1, float p2, float reach) {
  return std::max(std::min(p0, std::min(p1, p2)), -std::max(p0, std::max(p1, p2))) > reach;
}

// Returns whether one of three axes, the cross products of `edge` and the unit vectors, separates the triangle from the
// box. The vertices `a`, `b`, `c` are relative to the box's centre.
inline bool edge_separates(Vec3f a, Vec3f b, Vec3f c, Vec3f edge, Vec3f half) {
  const float x = std::fabs(edge.x), y = std::fabs(edge.y), z = std::fabs(edge.z);
  return separates(edge.y * a.z - edge.z * a.y, edge.y * b.z - edge.z * b.y, edge.y * c.z - edge.z * c.y,
                   half.y * z + half.z * y) ||
         separates(edge.z * a.x - edge.x * a.z, edge.z * b.x - edge.x * b.z, edge.z * c.x - edge.x * c.z,
                   half.z * x + half.x * z) ||
         separates(edge.x * a.y - edge.y * a.x, edge.x * b.y - edge.y * b.x, edge.x * c.y - edge.y * c.x,
                   half.x * y + half.y * x);
}

// Returns whether a triangle overlaps an axis-aligned box. Tests three axes of the box, the triangle's normal, and nine
// cross products. Source: Akenine-Moller, Fast 3D Triangle-Box Overlap Testing, 2001.
inline bool scalar_box_overlaps(Vec3f centre, Vec3f half, const Triangle& triangle) {
  const Vec3f a = triangle.a - centre, b = triangle.b - centre, c = triangle.c - centre;
  // Computes three tests before one branch: most triangles that miss are separated here, by each axis equally often.
  if (static_cast<int>(separates(a.x, b.x, c.x, half.x)) | static_cast<int>(separates(a.y, b.y, c.y, half.y)) |
      static_cast<int>(separates(a.z, b.z, c.z, half.z)))
    return false;
  const Vec3f ab = b - a, bc = c - b, ca = a - c;
  const Vec3f normal = cross(ab, bc);
  const float reach = half.x * std::fabs(normal.x) + half.y * std::fabs(normal.y) + half.z * std::fabs(normal.z);
  if (std::fabs(dot(normal, a)) > reach) return false;
  return !edge_separates(a, b, c, ab, half) && !edge_separates(a, b, c, bc, half) && !edge_separates(a, b, c, ca, half);
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_SCALAR_OVERLAP_H_
