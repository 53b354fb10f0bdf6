#include "core/geometry/triangle_overlap.h"

#include "core/base/planted_bug.h"

namespace locus {
namespace {

struct ProjectedRange {
  double low, high;
};

ProjectedRange range_of(double a, double b, double c) {
  return {std::min(a, std::min(b, c)), std::max(a, std::max(b, c))};
}

// Returns whether the projections of triangle and box on `axis` are disjoint. The box has half extents `half` around
// the origin. All three vertices are projected on the same rounded axis, so an axis with cancellation errors may miss a
// separation but never separates a triangle and a box that overlap.
bool separated_along(Vec3d axis, const Vec3d (&vertices)[3], Vec3d half) {
  const ProjectedRange range = range_of(dot(vertices[0], axis), dot(vertices[1], axis), dot(vertices[2], axis));
  const double extent = dot(abs(axis), half);
  return range.low > extent || range.high < -extent;
}

bool triangle_meets_box(const Triangle& triangle, const Obbf& box) {
  const Vec3d center = to_double(box.center), half = to_double(box.half);
  const Vec3d a = to_double(triangle.a), b = to_double(triangle.b), c = to_double(triangle.c);
  const Rotation& r = box.rotation;
  const Vec3d vertices[3] = {r.to_local(a - center), r.to_local(b - center), r.to_local(c - center)};
  constexpr Vec3d kUnit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const Vec3d unit : kUnit) {
    if (separated_along(unit, vertices, half)) return false;
  }
  if (separated_along(r.to_local(area_normal(triangle)), vertices, half)) return false;
  const Vec3d edges[3] = {r.to_local(b - a), r.to_local(c - b), r.to_local(a - c)};
  for (const Vec3d edge : edges) {
    for (const Vec3d unit : kUnit) {
      if (separated_along(cross(unit, edge), vertices, half)) return false;
    }
  }
  return true;
}

}  // namespace

bool ball_overlaps(const Ballf& ball, const Triangle& triangle) {
  if (!reaches(ball, bounds_of(triangle))) return false;
  const double distance = squared_distance(to_double(ball.center), triangle);
  const double limit = double{ball.radius} * ball.radius;
  return planted(PlantedBug::kStrictTie) ? distance < limit : distance <= limit;
}

bool box_overlaps(const Obbf& box, const Triangle& triangle) {
  return overlaps(bounds_of(box), to_double(bounds_of(triangle))) && triangle_meets_box(triangle, box);
}

}  // namespace locus
