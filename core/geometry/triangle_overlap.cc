#include "core/geometry/triangle_overlap.h"

#include "core/base/planted_bug.h"

namespace locus {
namespace {

double squared_distance_to_edge(Vec3d point, Vec3d from, Vec3d to) {
  const Vec3d edge = to - from;
  const Vec3d offset = point - from;
  const double along = dot(offset, edge);
  const double length = squared_length(edge);
  if (along <= 0) return squared_length(offset);
  if (along >= length) return squared_length(point - to);
  return squared_length(cross(offset, edge)) / length;
}

// Squared distance to the plane where the foot of the perpendicular lies within the triangle, else infinity.
double squared_distance_to_face(Vec3d point, Vec3d a, Vec3d b, Vec3d c) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Vec3d ab = b - a, ac = c - a;
  const Vec3d offset = point - a;
  const Vec3d normal = cross(ab, ac);
  const double nn = squared_length(normal);
  if (nn == 0) return kInfinity;
  const double weight_b = dot(cross(offset, ac), normal);
  const double weight_c = dot(cross(ab, offset), normal);
  const double weight_a = dot(cross(c - b, point - b), normal);
  if (!(weight_a >= 0 && weight_b >= 0 && weight_c >= 0)) return kInfinity;
  // The plane of a sliver is known too badly to measure from, but a point of the triangle is never too near.
  constexpr double kSliver = 0x1p-40;  // square of the sine at vertex a
  if (nn < kSliver * squared_length(ab) * squared_length(ac)) {
    const double sum = weight_a + weight_b + weight_c;
    return squared_length(offset - (ab * (weight_b / sum) + ac * (weight_c / sum)));
  }
  const double height = dot(offset, normal);
  return height * height / nn;
}

struct Range {
  double low, high;
};

Range range_of(double a, double b, double c) { return {std::min(a, std::min(b, c)), std::max(a, std::max(b, c))}; }

// Whether the box of half extents `half` around the origin and the triangle have disjoint shadows on `axis`. Shadows of
// all three vertices are taken anew: an axis spoilt by cancellation is a useless one, never a false one.
bool separated_along(Vec3d axis, const Vec3d (&vertices)[3], Vec3d half) {
  const Range range = range_of(dot(vertices[0], axis), dot(vertices[1], axis), dot(vertices[2], axis));
  const double reach = dot(abs(axis), half);
  return range.low > reach || range.high < -reach;
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

double squared_distance(Vec3d point, const Triangle& triangle) {
  const Vec3d a = to_double(triangle.a), b = to_double(triangle.b), c = to_double(triangle.c);
  const double edges = std::min(squared_distance_to_edge(point, a, b),
                                std::min(squared_distance_to_edge(point, b, c), squared_distance_to_edge(point, c, a)));
  return std::min(edges, squared_distance_to_face(point, a, b, c));
}

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
