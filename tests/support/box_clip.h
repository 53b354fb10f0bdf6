// Overlap of boxes with segments, boxes and triangles by clipping in long double: a reference that does not use
// separating axes. The clipping functions take coordinates relative to the centre and the axes of the box.
#ifndef LOCUS_TESTS_SUPPORT_BOX_CLIP_H_
#define LOCUS_TESTS_SUPPORT_BOX_CLIP_H_

#include <array>
#include <vector>

#include "tests/support/real.h"

namespace locus::test {

// Returns whether the segment has a point in the box around the origin with half extents `half` + `grown`; `grown` may
// be negative.
inline bool clipped_segment_remains(Vec3r from, Vec3r to, Vec3r half, Real grown) {
  Real low = 0, high = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const Real h = half[axis] + grown, d = to[axis] - from[axis];
    if (h < 0) return false;
    if (d == 0) {
      if (std::abs(from[axis]) > h) return false;
      continue;
    }
    const Real a = (-h - from[axis]) / d, b = (h - from[axis]) / d;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low <= high;
}

// Returns whether any part of the polygon lies within the box around the origin with half extents `half` + `grown`.
// Source: Sutherland and Hodgman, Reentrant Polygon Clipping, 1974.
inline bool clipped_polygon_remains(std::vector<Vec3r> polygon, Vec3r half, Real grown) {
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2;
    const Real sign = side % 2 == 0 ? 1 : -1;
    const auto excess = [&](Vec3r v) { return sign * v[axis] - (half[axis] + grown); };
    if (half[axis] + grown < 0) return false;
    std::vector<Vec3r> kept;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Vec3r a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      const Real ea = excess(a), eb = excess(b);
      if (ea <= 0) kept.push_back(a);
      if ((ea < 0 && eb > 0) || (ea > 0 && eb < 0)) kept.push_back(a + (b - a) * (ea / (ea - eb)));
    }
    polygon = kept;
    if (polygon.empty()) return false;
  }
  return true;
}

// Oriented box in long double. `axes` are its unit axes, `half` contains its half extents, and half_edges[i] is the
// product of axes[i] and half[i].
struct RealBox {
  Vec3r center;
  std::array<Vec3r, 3> half_edges;
  std::array<Vec3r, 3> axes;
  Vec3r half;

  Vec3r corner(int number) const {
    Vec3r place = center;
    for (int axis = 0; axis < 3; ++axis) place = place + half_edges[axis] * Real(number & (1 << axis) ? 1 : -1);
    return place;
  }
  Vec3r local(Vec3r point) const {
    const Vec3r offset = point - center;
    return {dot(offset, axes[0]), dot(offset, axes[1]), dot(offset, axes[2])};
  }
};

inline RealBox real_box(Vec3r center, const Quaternion& rotation, Vec3r half) {
  RealBox box{center, {}, {}, half};
  for (int axis = 0; axis < 3; ++axis) {
    Vec3r unit;
    unit[axis] = 1;
    box.axes[axis] = turned(rotation, unit);
    box.half_edges[axis] = box.axes[axis] * half[axis];
  }
  return box;
}

inline bool any_edge_meets(const RealBox& edges, const RealBox& solid, Real grown) {
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      if (corner & (1 << axis)) continue;
      const Vec3r from = solid.local(edges.corner(corner)), to = solid.local(edges.corner(corner | (1 << axis)));
      if (clipped_segment_remains(from, to, solid.half, grown)) return true;
    }
  }
  return false;
}

// Returns whether two boxes share a point: they do if and only if an edge of one box intersects the other box. `grown`
// is added to the half extents of this other box.
inline bool boxes_share_a_point(const RealBox& a, const RealBox& b, Real grown) {
  return any_edge_meets(a, b, grown) || any_edge_meets(b, a, grown);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_BOX_CLIP_H_
