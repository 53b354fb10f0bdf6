// One triangle and one ray in long double: the point where they meet, its distance from the triangle's border, and the
// slope of the ray. Used by the proof that no ray misses. Shares only vectors with the product. Immutable.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_REAL_TRIANGLE_H_
#define LOCUS_TESTS_SUPPORT_PROOF_REAL_TRIANGLE_H_

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/geometry/triangle.h"
#include "tests/support/real.h"

namespace locus::test {

// Returns the unit vector along v, or the zero vector if v is zero.
inline Vec3r unit(Vec3r v) {
  const Real size = length(v);
  return size == 0 ? Vec3r{} : v * (1 / size);
}

struct RealRay {
  Vec3r origin, direction;
};

// Point where a ray meets the plane of a triangle.
struct Meeting {
  Real t;
  Real inset;  // distance of the point from the triangle's nearest edge, within the plane; negative outside
  Real slope;  // direction . unit normal: negative if the front is seen
};

class RealTriangle {
 public:
  explicit RealTriangle(const Triangle& triangle)
      : RealTriangle(to_real(triangle.a), to_real(triangle.b), to_real(triangle.c)) {}
  RealTriangle(Vec3r a, Vec3r b, Vec3r c)
      : corners_{a, b, c}, normal_(unit(cross(corners_[1] - corners_[0], corners_[2] - corners_[0]))) {
    for (int i = 0; i < 3; ++i) inward_[i] = unit(cross(normal_, corners_[(i + 1) % 3] - corners_[i]));
  }

  Real slope(const RealRay& ray) const { return dot(normal_, ray.direction); }

  // Returns the point where the ray meets the triangle's plane. Returns nullopt if the triangle has no area or is
  // exactly edge-on, or if t is not within 0 .. limit.
  std::optional<Meeting> meet(const RealRay& ray, Real limit) const {
    Meeting meeting;
    meeting.slope = slope(ray);
    if (meeting.slope == 0) return std::nullopt;
    meeting.t = dot(normal_, corners_[0] - ray.origin) / meeting.slope;
    if (!(meeting.t >= 0 && meeting.t <= limit)) return std::nullopt;
    meeting.inset = inset(ray.origin + ray.direction * meeting.t);
    return meeting;
  }

  Real distance(Vec3r point) const {
    if (inset(point) >= 0 && normal_ != Vec3r{}) return std::fabs(dot(normal_, point - corners_[0]));
    Real nearest = length(point - corners_[0]);
    for (int i = 0; i < 3; ++i) {
      const Vec3r edge = corners_[(i + 1) % 3] - corners_[i], from = point - corners_[i];
      const Real square = dot(edge, edge);
      const Real along = square == 0 ? 0 : std::clamp<Real>(dot(edge, from) / square, 0, 1);
      nearest = std::min(nearest, length(from - edge * along));
    }
    return nearest;
  }

 private:
  Real inset(Vec3r point) const {
    return std::min({dot(point - corners_[0], inward_[0]), dot(point - corners_[1], inward_[1]),
                     dot(point - corners_[2], inward_[2])});
  }

  Vec3r corners_[3], normal_, inward_[3];
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_REAL_TRIANGLE_H_
