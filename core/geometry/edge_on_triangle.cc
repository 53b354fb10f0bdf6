#include "core/geometry/edge_on_triangle.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/geometry/double_double.h"

namespace locus {
namespace {

using Vec3x = Vec3<DoubleDouble>;

Vec3x exactly(Vec3d v) { return {v.x, v.y, v.z}; }
Vec3x exactly(Vec3f v) { return exactly(to_double(v)); }
Vec3d rounded(Vec3x v) { return {v.x.rounded(), v.y.rounded(), v.z.rounded()}; }

// Returns |q|^2 * v, rotated by the inverse of q: (w^2 - |u|^2) v + 2 (u . v) u - 2 w (u x v), with q = (u, w).
Vec3x rotated_back(const Quaternion& q, Vec3x v) {
  const Vec3x u = exactly(Vec3f{q.x, q.y, q.z});
  const DoubleDouble w = double{q.w}, two = 2.0;
  return v * (w * w - dot(u, u)) + u * (two * dot(u, v)) - cross(u, v) * (two * w);
}

DoubleDouble squared_length(const Quaternion& q) {
  const Vec3x u = exactly(Vec3f{q.x, q.y, q.z});
  return dot(u, u) + DoubleDouble(double{q.w}) * double{q.w};
}

// Corner of a triangle relative to the ray's origin, sheared so that the ray is the depth axis.
struct EdgeOnCorner {
  DoubleDouble x, y;
  double depth;
};

// Projection of a triangle's corners along the ray. All lengths are multiplied by unit(), so that no division is
// needed; x and y of a corner are also multiplied by the direction's largest component.
class Projection {
 public:
  explicit Projection(const StoredRay& ray)
      : unit_(DoubleDouble(double{ray.scale}) * squared_length(ray.quaternion)),
        origin_(rotated_back(ray.quaternion, exactly(ray.origin) - exactly(ray.translation))),
        direction_(rotated_back(ray.quaternion, exactly(ray.direction))) {
    const Vec3d size = abs(rounded(direction_));
    z_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    // Swaps x and y for a negative direction, as TriangleRay does, so that front faces keep their orientation.
    if (direction_[z_].sign() < 0) std::swap(x_, y_);
  }

  EdgeOnCorner corner(Vec3f vertex) const {
    const Vec3x from = exactly(vertex) * unit_ - origin_;
    return {from[x_] * direction_[z_] - from[z_] * direction_[x_],
            from[y_] * direction_[z_] - from[z_] * direction_[y_], from[z_].rounded()};
  }

  double unit() const { return unit_.rounded(); }
  double along() const { return direction_[z_].rounded(); }

 private:
  DoubleDouble unit_;
  Vec3x origin_, direction_;
  int x_, y_, z_;
};

DoubleDouble edge_function(const EdgeOnCorner& from, const EdgeOnCorner& to) { return from.x * to.y - from.y * to.x; }

bool culled(Cull cull, int side) { return (cull == Cull::kBack && side <= 0) || (cull == Cull::kFront && side >= 0); }

// Point of an edge; `fraction` is 0 at the edge's first corner and 1 at the second.
struct EdgePoint {
  double squared_distance;  // squared distance of the point from the ray
  double t;
  double fraction;
};

// Returns the point of the edge nearest to the ray among the points with t >= 0; nullopt if the edge has no such point.
// `along` is Projection::along().
std::optional<EdgePoint> nearest_edge_point(const EdgeOnCorner& from, const EdgeOnCorner& to, double along) {
  const double x = from.x.rounded(), y = from.y.rounded();
  const double edge_x = (to.x - from.x).rounded(), edge_y = (to.y - from.y).rounded();
  const double t = from.depth / along, edge_t = to.depth / along - t;
  if (t < 0 && t + edge_t < 0) return std::nullopt;
  const double square = edge_x * edge_x + edge_y * edge_y;
  double fraction = square == 0 ? 0 : std::clamp(-(x * edge_x + y * edge_y) / square, 0.0, 1.0);
  if (t < 0) fraction = std::max(fraction, -t / edge_t);
  if (t + edge_t < 0) fraction = std::min(fraction, -t / edge_t);
  const double distance_x = x + fraction * edge_x, distance_y = y + fraction * edge_y;
  return EdgePoint{distance_x * distance_x + distance_y * distance_y, std::max(t + fraction * edge_t, 0.0), fraction};
}

// Returns the point of the triangle's border nearest to the ray among the points with t >= 0; nullopt if its squared
// distance from the ray exceeds `limit`.
std::optional<EdgeOnHit> hit_at_border(const EdgeOnCorner& a, const EdgeOnCorner& b, const EdgeOnCorner& c,
                                       double along, double limit) {
  std::optional<EdgeOnHit> hit;
  const auto offer = [&](const std::optional<EdgePoint>& point, auto weights_at) {
    if (!point || !(point->squared_distance <= limit)) return;
    limit = point->squared_distance;
    const auto [u, v] = weights_at(point->fraction);
    hit = EdgeOnHit{point->t, u, v};
  };
  offer(nearest_edge_point(a, b, along), [](double fraction) { return std::pair(fraction, 0.0); });
  offer(nearest_edge_point(b, c, along), [](double fraction) { return std::pair(1 - fraction, fraction); });
  offer(nearest_edge_point(c, a, along), [](double fraction) { return std::pair(0.0, 1 - fraction); });
  return hit;
}

}  // namespace

std::optional<EdgeOnHit> edge_on_hit(const StoredRay& ray, const Triangle& triangle, Cull cull,
                                     EdgeOnVerdict double_verdict) {
  LOCUS_DCHECK_GE(double_verdict.corner_error, 0.0);
  const Projection projection(ray);
  const EdgeOnCorner a = projection.corner(triangle.a), b = projection.corner(triangle.b),
                     c = projection.corner(triangle.c);
  const DoubleDouble weight_a = edge_function(c, b), weight_b = edge_function(a, c), weight_c = edge_function(b, a);
  const DoubleDouble determinant = weight_a + weight_b + weight_c;
  const int side = determinant.sign();
  if (culled(cull, side)) return std::nullopt;
  if (side != 0 && weight_a.sign() * side >= 0 && weight_b.sign() * side >= 0 && weight_c.sign() * side >= 0) {
    const double wa = weight_a.rounded(), wb = weight_b.rounded(), wc = weight_c.rounded();
    const double sum = determinant.rounded();
    const double t = (wa * a.depth + wb * b.depth + wc * c.depth) / (sum * projection.along());
    if (t >= -double_verdict.corner_error) return EdgeOnHit{std::max(t, 0.0), wb / sum, wc / sum};
  }
  if (!double_verdict.hit) return std::nullopt;
  const double limit = double_verdict.corner_error * projection.unit() * projection.unit();
  return hit_at_border(a, b, c, projection.along(), limit * limit);
}

}  // namespace locus
