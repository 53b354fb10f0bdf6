// Vectors in the compiler's 113-bit floating point, for references that need more than long double. Slow.
#ifndef LOCUS_TESTS_SUPPORT_QUAD_H_
#define LOCUS_TESTS_SUPPORT_QUAD_H_

#include <cmath>

#include "core/geometry/transform.h"
#include "core/geometry/triangle.h"

namespace locus::test {

__extension__ typedef __float128 Quad;
using Vec3q = Vec3<Quad>;

template <class S>
Vec3q to_quad(Vec3<S> v) {
  return {v.x, v.y, v.z};
}

// Returns the length of `v`. The square root, and so the length, is only as precise as long double.
inline Quad length(Vec3q v) { return std::sqrt(static_cast<long double>(dot(v, v))); }

// Returns `v` in mesh axes, computed from the stored values. For a position, the caller must subtract the translation
// from `v`.
inline Vec3q turned_to_mesh(const Transform& transform, Vec3q v) {
  const Quaternion& q = transform.quaternion;
  const Quad x = q.x, y = q.y, z = q.z, w = q.w;
  const Vec3q u = {-x, -y, -z};
  const Vec3q c = cross(u, v);
  return (v + (c * w + cross(u, c)) * (2 / (x * x + y * y + z * z + w * w))) * (1 / Quad{transform.scale});
}

// Point where a line meets the plane of a triangle. `inset` is the point's distance from the nearest edge, negative
// outside of the triangle.
struct QuadMeeting {
  Quad slope;  // direction . unit normal
  Quad t, inset;
};

class QuadTriangle {
 public:
  explicit QuadTriangle(const Triangle& triangle)
      : corners_{to_quad(triangle.a), to_quad(triangle.b), to_quad(triangle.c)},
        normal_(cross(corners_[1] - corners_[0], corners_[2] - corners_[0])) {}

  // Returns the point where the line meets the triangle's plane. Precondition: the triangle has area and is not exactly
  // edge-on.
  QuadMeeting meet(Vec3q origin, Vec3q direction) const {
    const Quad speed = dot(normal_, direction);
    QuadMeeting meeting{speed / length(normal_), dot(normal_, corners_[0] - origin) / speed, 0};
    const Vec3q place = origin + direction * meeting.t;
    for (int i = 0; i < 3; ++i) {
      const Quad inset = inset_from(i, place);
      if (i == 0 || inset < meeting.inset) meeting.inset = inset;
    }
    return meeting;
  }

  Quad distance(Vec3q place) const {
    Quad nearest = dot(normal_, place - corners_[0]) / length(normal_);
    if (nearest < 0) nearest = -nearest;
    bool inside = true;
    for (int i = 0; i < 3; ++i) inside = inside && inset_from(i, place) >= 0;
    for (int i = 0; i < 3 && !inside; ++i) {
      const Vec3q edge = corners_[(i + 1) % 3] - corners_[i], from = place - corners_[i];
      Quad along = dot(edge, from) / dot(edge, edge);
      along = along < 0 ? 0 : along > 1 ? 1 : along;
      const Quad to_edge = length(from - edge * along);
      if (i == 0 || to_edge < nearest) nearest = to_edge;
    }
    return nearest;
  }

 private:
  Quad inset_from(int i, Vec3q place) const {
    const Vec3q inward = cross(normal_, corners_[(i + 1) % 3] - corners_[i]);
    return dot(place - corners_[i], inward) / length(inward);
  }

  Vec3q corners_[3], normal_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_QUAD_H_
