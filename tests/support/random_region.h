// Random balls and boxes on and near the triangles of a mesh, of sizes from zero to the whole mesh; some of them only
// touch a triangle. Used by the tests of the region kernels and by tests of planted bugs in the kernels.
#ifndef LOCUS_TESTS_SUPPORT_RANDOM_REGION_H_
#define LOCUS_TESTS_SUPPORT_RANDOM_REGION_H_

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/geometry/triangle_overlap.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/random.h"

namespace locus::test {

inline std::vector<Triangle> moved(std::vector<Triangle> triangles, float scale, Vec3f by) {
  for (Triangle& triangle : triangles)
    for (Vec3f* vertex : {&triangle.a, &triangle.b, &triangle.c}) *vertex = *vertex * scale + by;
  return triangles;
}

// Returns the factor by which the half extents of a box must be multiplied so that the box just touches the triangle.
inline double touching_scale(const Obbf& box, const Triangle& triangle) {
  const Rotation& r = box.rotation;
  const Vec3d center = to_double(box.center), half = to_double(box.half);
  const Vec3d a = r.to_local(to_double(triangle.a) - center), b = r.to_local(to_double(triangle.b) - center),
              c = r.to_local(to_double(triangle.c) - center);
  const Vec3d units[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, edges[3] = {b - a, c - b, a - c};
  std::vector<Vec3d> axes = {units[0], units[1], units[2], cross(edges[0], edges[1])};
  for (const Vec3d unit : units)
    for (const Vec3d edge : edges) axes.push_back(cross(unit, edge));
  double scale = 0;
  for (const Vec3d axis : axes) {
    const double p = dot(axis, a), q = dot(axis, b), s = dot(axis, c), reach = dot(abs(axis), half);
    const double gap = std::max(std::min(p, std::min(q, s)), -std::max(p, std::max(q, s)));
    if (reach > 0) scale = std::max(scale, gap / reach);
  }
  return scale;
}

// Generator of regions for one mesh. Borrows the triangles, which must outlive the generator.
class RandomRegions {
 public:
  RandomRegions(const std::vector<Triangle>& triangles, uint64_t seed) : triangles_(triangles), random_(seed) {
    for (const Triangle& triangle : triangles) bounds_ = merge(bounds_, bounds_of(triangle));
  }

  Ballf ball() { return {center(), static_cast<float>(size())}; }
  Obbf box(bool turned) {
    Obbf box{center(), to_float(Vec3d{size(), size(), size()}), {}};
    if (turned) box.rotation = rotation_of(random_.rotation());
    return box;
  }
  // Generates a ball that touches a triangle: the ball's radius is the distance of the triangle, rounded to float and
  // changed by at most two units in the last place.
  Ballf touching_ball() {
    Ballf ball{center(), 0};
    ball.radius = static_cast<float>(std::sqrt(squared_distance(to_double(ball.center), random_.pick(triangles_))));
    const float toward = random_.chance(0.5) ? 0 : 1e30f;
    for (int steps = random_.whole(0, 2); steps > 0; --steps) ball.radius = std::nextafter(ball.radius, toward);
    return ball;
  }
  // Generates a random box and scales it so that it touches a triangle, up to a few units in the last place of the half
  // extents. A box that would have to grow eightfold or more is returned unscaled.
  Obbf touching_box(bool turned) {
    Obbf box = this->box(turned);
    const auto scale = static_cast<float>(touching_scale(box, random_.pick(triangles_)));
    if (!(scale < 8)) return box;
    const float unit = random_.chance(0.5) ? 1 : 1 + 0x1p-23f * static_cast<float>(random_.whole(-3, 3));
    box.half = box.half * scale * unit;
    return box;
  }

 private:
  Vec3f center() {
    if (random_.chance(0.2)) return random_.pick(triangles_).b;
    Vec3f point;
    for (int axis = 0; axis < 3; ++axis) point[axis] = random_.float_between(bounds_.min[axis], bounds_.max[axis]);
    if (random_.chance(0.5)) return point;
    const Triangle& triangle = random_.pick(triangles_);
    const double u = random_.unit(), v = random_.unit() * (1 - u);
    return to_float(to_double(triangle.a) * (1 - u - v) + to_double(triangle.b) * u + to_double(triangle.c) * v);
  }
  double size() {
    if (random_.chance(0.05)) return 0;
    return double{max_component(bounds_.extent())} * random_.magnitude(-10, 1);
  }

  const std::vector<Triangle>& triangles_;
  Aabbf bounds_;
  Random random_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RANDOM_REGION_H_
