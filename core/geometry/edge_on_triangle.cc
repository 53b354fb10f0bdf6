#include "core/geometry/edge_on_triangle.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/geometry/double_double.h"

namespace locus {
namespace {

using Vec3x = Vec3<DoubleDouble>;

Vec3x exactly(Vec3d v) { return {v.x, v.y, v.z}; }
Vec3x exactly(Vec3f v) { return exactly(to_double(v)); }
Vec3d rounded(Vec3x v) { return {v.x.rounded(), v.y.rounded(), v.z.rounded()}; }

// |q|^2 times v, turned back by q: (w^2 - |u|^2) v + 2 (u . v) u - 2 w (u x v), with q = (u, w).
Vec3x turned_back(const Quaternion& q, Vec3x v) {
  const Vec3x u = exactly(Vec3f{q.x, q.y, q.z});
  const DoubleDouble w = double{q.w}, two = 2.0;
  return v * (w * w - dot(u, u)) + u * (two * dot(u, v)) - cross(u, v) * (two * w);
}

DoubleDouble squared_length(const Quaternion& q) {
  const Vec3x u = exactly(Vec3f{q.x, q.y, q.z});
  return dot(u, u) + DoubleDouble(double{q.w}) * double{q.w};
}

// A corner seen along the ray: from the ray's origin, sheared.
struct Corner {
  DoubleDouble x, y;
  double depth;
};

// Lengths are multiplied by `unit`, so that nothing needs a quotient; sheared ones once more by the direction's.
class Projection {
 public:
  explicit Projection(const StoredRay& ray)
      : unit_(DoubleDouble(double{ray.scale}) * squared_length(ray.quaternion)),
        origin_(turned_back(ray.quaternion, exactly(ray.origin) - exactly(ray.translation))),
        direction_(turned_back(ray.quaternion, exactly(ray.direction))) {
    const Vec3d size = abs(rounded(direction_));
    z_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    // Keeps the winding, as in TriangleRay.
    if (direction_[z_].sign() < 0) std::swap(x_, y_);
  }

  Corner corner(Vec3f vertex) const {
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

DoubleDouble edge_function(const Corner& from, const Corner& to) { return from.x * to.y - from.y * to.x; }

bool culled(Cull cull, int side) { return (cull == Cull::kBack && side <= 0) || (cull == Cull::kFront && side >= 0); }

// A place of an edge, `share` of the way from its first corner to its second.
struct Place {
  double squared_distance;  // from the ray
  double t;
  double share;
};

// The nearest to the ray of those with t >= 0.
std::optional<Place> nearest_place(const Corner& from, const Corner& to, double along) {
  const double x = from.x.rounded(), y = from.y.rounded();
  const double way_x = (to.x - from.x).rounded(), way_y = (to.y - from.y).rounded();
  const double t = from.depth / along, way_t = to.depth / along - t;
  if (t < 0 && t + way_t < 0) return std::nullopt;
  const double square = way_x * way_x + way_y * way_y;
  double share = square == 0 ? 0 : std::clamp(-(x * way_x + y * way_y) / square, 0.0, 1.0);
  if (t < 0) share = std::max(share, -t / way_t);
  if (t + way_t < 0) share = std::min(share, -t / way_t);
  const double off_x = x + share * way_x, off_y = y + share * way_y;
  return Place{off_x * off_x + off_y * off_y, std::max(t + share * way_t, 0.0), share};
}

std::optional<EdgeOnHit> hit_at_border(const Corner& a, const Corner& b, const Corner& c, double along, double most) {
  std::optional<EdgeOnHit> hit;
  const auto offer = [&](const std::optional<Place>& place, auto weights_at) {
    if (!place || !(place->squared_distance <= most)) return;
    most = place->squared_distance;
    const auto [u, v] = weights_at(place->share);
    hit = EdgeOnHit{place->t, u, v};
  };
  offer(nearest_place(a, b, along), [](double share) { return std::pair(share, 0.0); });
  offer(nearest_place(b, c, along), [](double share) { return std::pair(1 - share, share); });
  offer(nearest_place(c, a, along), [](double share) { return std::pair(0.0, 1 - share); });
  return hit;
}

}  // namespace

std::optional<EdgeOnHit> edge_on_hit(const StoredRay& ray, const Triangle& triangle, Cull cull,
                                     EdgeOnVerdict in_double) {
  const Projection projection(ray);
  const Corner a = projection.corner(triangle.a), b = projection.corner(triangle.b), c = projection.corner(triangle.c);
  const DoubleDouble weight_a = edge_function(c, b), weight_b = edge_function(a, c), weight_c = edge_function(b, a);
  const DoubleDouble determinant = weight_a + weight_b + weight_c;
  const int side = determinant.sign();
  if (culled(cull, side)) return std::nullopt;
  if (side != 0 && weight_a.sign() * side >= 0 && weight_b.sign() * side >= 0 && weight_c.sign() * side >= 0) {
    const double of_a = weight_a.rounded(), of_b = weight_b.rounded(), of_c = weight_c.rounded();
    const double sum = determinant.rounded();
    const double t = (of_a * a.depth + of_b * b.depth + of_c * c.depth) / (sum * projection.along());
    if (t >= -in_double.blur) return EdgeOnHit{std::max(t, 0.0), of_b / sum, of_c / sum};
  }
  if (!in_double.hit) return std::nullopt;
  const double most = in_double.blur * projection.unit() * projection.unit();
  return hit_at_border(a, b, c, projection.along(), most * most);
}

}  // namespace locus
