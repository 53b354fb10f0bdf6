#include "core/geometry/point_triangle.h"

#include <limits>

namespace locus {
namespace {

// Point of the triangle and its squared distance from the query point.
struct Candidate {
  double squared_distance = std::numeric_limits<double>::infinity();
  Vec3d point;
};

Candidate on_edge(Vec3d point, Vec3d from, Vec3d to) {
  const Vec3d edge = to - from;
  const Vec3d offset = point - from;
  const double along = dot(offset, edge);
  const double length = squared_length(edge);
  if (along <= 0) return {squared_length(offset), from};
  if (along >= length) return {squared_length(point - to), to};
  return {squared_length(cross(offset, edge)) / length, from + edge * (along / length)};
}

// Returns the projection of `point` on the triangle's plane if the projection lies within the triangle, else a
// candidate at infinite distance.
Candidate on_face(Vec3d point, Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d ab = b - a, ac = c - a;
  const Vec3d offset = point - a;
  const Vec3d normal = cross(ab, ac);
  const double nn = squared_length(normal);
  if (nn == 0) return {};
  const double weight_b = dot(cross(offset, ac), normal);
  const double weight_c = dot(cross(ab, offset), normal);
  const double weight_a = dot(cross(c - b, point - b), normal);
  const double sum = weight_a + weight_b + weight_c;
  if (!(weight_a >= 0 && weight_b >= 0 && weight_c >= 0 && sum > 0)) return {};
  const Vec3d inward = ab * (weight_b / sum) + ac * (weight_c / sum);
  // The normal of a sliver is too imprecise to compute the height of `point` above the plane. So use the distance to
  // the projection, a point of the triangle: this distance is never too small.
  constexpr double kSliver = 0x1p-40;  // squared sine of the angle at vertex a
  if (nn < kSliver * squared_length(ab) * squared_length(ac)) return {squared_length(offset - inward), a + inward};
  const double height = dot(offset, normal);
  return {height * height / nn, a + inward};
}

// Returns the candidate with the smallest distance; among equal distances, the first.
Candidate nearest(Vec3d point, Vec3d a, Vec3d b, Vec3d c) {
  Candidate best = on_edge(point, a, b);
  for (const Candidate& other : {on_edge(point, b, c), on_edge(point, c, a), on_face(point, a, b, c)})
    if (other.squared_distance < best.squared_distance) best = other;
  return best;
}

}  // namespace

double squared_distance(Vec3d point, Vec3d a, Vec3d b, Vec3d c) { return nearest(point, a, b, c).squared_distance; }

double squared_distance(Vec3d point, const Triangle& triangle) {
  return squared_distance(point, to_double(triangle.a), to_double(triangle.b), to_double(triangle.c));
}

Vec3d nearest_on_triangle(Vec3d point, Vec3d a, Vec3d b, Vec3d c) { return nearest(point, a, b, c).point; }

double distance(Vec3d point, const Triangle& triangle) {
  return std::sqrt(
      std::max(squared_distance(point, triangle), squared_distance(point, to_double(bounds_of(triangle)))));
}

}  // namespace locus
