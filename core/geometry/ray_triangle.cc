#include "core/geometry/ray_triangle.h"

#include <cmath>
#include <utility>

#include "core/base/planted_bug.h"
#include "core/geometry/edge_on_triangle.h"
#include "core/geometry/float_step.h"

namespace locus {
namespace {

int exponent_of(Vec3d direction) {
  int exponent = 0;
  (void)std::frexp(max_component(abs(direction)), &exponent);
  return exponent;
}

Vec3d scaled(Vec3d direction, int exponent) {
  return {std::ldexp(direction.x, -exponent), std::ldexp(direction.y, -exponent), std::ldexp(direction.z, -exponent)};
}

bool culled(Cull cull, double determinant) {
  if (cull == Cull::kNone) return false;
  const bool front = determinant > 0;
  return cull == Cull::kBack ? !front : front;
}

// A corner of a triangle, seen along the ray: from the ray's origin, sheared, times the direction's z; z itself is a
// depth.
struct Corner {
  double x, y, z;
};

double size_of(Corner corner) { return std::max(std::abs(corner.x), std::abs(corner.y)); }
double least_of(double a, double b, double c) { return std::min(a, std::min(b, c)); }
double most_of(double a, double b, double c) { return std::max(a, std::max(b, c)); }

// The sum turns -0 into 0, so that equal answers have equal bytes.
TriangleHit hit_of(double t, double u, double v) {
  return {static_cast<float>(t) + 0.0f, static_cast<float>(u), static_cast<float>(v)};
}

}  // namespace

// What double sees of a triangle along the ray. Its error, with u = 2^-53 and R = max |origin| + max |vertex|:
//
// - The way into mesh axes, matrix included, rounds origin and direction by less than 74 u of them. So a sheared
//   coordinate is off by less than 300 u R, and an edge function, two products of coordinates up to S, by less than
//   N = 2^-42 R (S + 2^-44 R).
// - The depth of a hit is an average of the corners' with the edge functions as weights. It is off by less than
//   3 N span / |determinant| where that is more than 8 N; the hit itself by sqrt(3) of it.
struct TriangleRay::Seen {
  Corner a, b, c;
  double weight_a, weight_b, weight_c;  // the edge functions
  double least, most;                   // of them
  double determinant;
  double size;   // S
  double span;   // of the depths
  double reach;  // R at least: a vertex is no farther from the origin than 2 S + max |depth|

  // All others are hit within 2^-23 R of where they are.
  bool is_nearly_edge_on() const {
    return std::abs(determinant) <= (size + 0x1p-44 * reach) * (0x1p-16 * span + 0x1p-39 * reach);
  }
  bool is_beside() const { return least < 0 && most > 0; }
  // How far a corner may be off: 2^-44.8 R in each coordinate.
  double blur() const { return 0x1p-43 * reach; }
  // Beside by more than any rounding.
  bool is_far_beside() const {
    const double noise = 0x1p-42 * reach * (size + 0x1p-44 * reach);
    if (least < -noise && most > noise) return true;
    return most_of(least_of(a.x, b.x, c.x), least_of(a.y, b.y, c.y), 0) > blur() ||
           least_of(most_of(a.x, b.x, c.x), most_of(a.y, b.y, c.y), 0) < -blur();
  }
};

TriangleRay::TriangleRay(Vec3d origin, Vec3d direction, Cull cull)
    : TriangleRay(StoredRay{origin, direction, {}, {}, 1}, origin, direction, cull) {}

TriangleRay::TriangleRay(const Transform& transform, Vec3d origin, Vec3d direction, Cull cull)
    : TriangleRay(StoredRay{origin, direction, transform.translation, transform.quaternion, transform.scale},
                  transform.point_to_mesh(origin), transform.direction_to_mesh(direction), cull) {}

TriangleRay::TriangleRay(const StoredRay& stored, Vec3d origin, Vec3d direction, Cull cull)
    : stored_(stored),
      exponent_(exponent_of(direction)),
      origin_(origin),
      direction_(scaled(direction, exponent_)),
      start_(max_component(abs(origin))),
      slabs_({to_float(origin_), to_float(direction_)}, kTrianglePad),
      cull_(cull) {
  const Vec3d size = abs(direction_);
  axis_z_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  axis_x_ = (axis_z_ + 1) % 3;
  axis_y_ = (axis_z_ + 2) % 3;
  // Keeps the winding: seen along the ray, x to y always turns the same way.
  if (direction_[axis_z_] < 0) std::swap(axis_x_, axis_y_);
}

float TriangleRay::from_scaled(float t) const {
  if (std::isinf(t)) return t;
  const double given = std::ldexp(static_cast<double>(t), -exponent_);
  constexpr float kLargest = std::numeric_limits<float>::max();
  return given >= kLargest ? kLargest : static_cast<float>(given);
}

float TriangleRay::to_scaled(float t) const {
  if (std::isinf(t)) return t;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  if (t == std::numeric_limits<float>::max()) return kInfinity;
  const double scaled = std::ldexp(static_cast<double>(next_above(t)), exponent_);
  if (scaled >= std::numeric_limits<float>::max()) return kInfinity;
  return next_above(static_cast<float>(scaled));
}

// Bounds the rounding of `depth` in edge_test(): under 264 roundings of 2^-53 of reach^3 on the way from the vertices,
// and 72 of 2^-51 of |origin| reach^2 for the origin's own way into mesh axes.
double TriangleRay::depth_noise(const Triangle& triangle) const {
  double reach = 0;
  for (const Vec3f vertex : {triangle.a, triangle.b, triangle.c})
    reach = std::max(reach, max_component(abs(to_double(vertex) - origin_)));
  return 0x1p-44 * reach * reach * (reach + start_);
}

TriangleRay::Seen TriangleRay::see(const Triangle& triangle) const {
  const double dx = direction_[axis_x_], dy = direction_[axis_y_], dz = direction_[axis_z_];
  const auto corner = [&](Vec3f vertex) {
    const Vec3d from = to_double(vertex) - origin_;
    const double z = from[axis_z_];
    return Corner{from[axis_x_] * dz - z * dx, from[axis_y_] * dz - z * dy, z};
  };
  Seen seen;
  const Corner a = seen.a = corner(triangle.a), b = seen.b = corner(triangle.b), c = seen.c = corner(triangle.c);
  seen.weight_a = c.x * b.y - c.y * b.x;
  seen.weight_b = a.x * c.y - a.y * c.x;
  seen.weight_c = b.x * a.y - b.y * a.x;
  seen.least = least_of(seen.weight_a, seen.weight_b, seen.weight_c);
  seen.most = most_of(seen.weight_a, seen.weight_b, seen.weight_c);
  seen.determinant = seen.weight_a + seen.weight_b + seen.weight_c;
  seen.size = most_of(size_of(a), size_of(b), size_of(c));
  const double nearest = least_of(a.z, b.z, c.z), farthest = most_of(a.z, b.z, c.z);
  seen.span = farthest - nearest;
  seen.reach = 2 * (start_ + seen.size + std::max(-nearest, farthest));
  return seen;
}

// In a plane across an axis, along which the ray does not go at all: where nothing has turned the ray, certainly.
bool TriangleRay::is_exactly_edge_on(const Triangle& triangle) const {
  if (!stored_.quaternion.is_identity()) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const float plane = triangle.a[axis];
    if (direction_[axis] == 0 && triangle.b[axis] == plane && triangle.c[axis] == plane) return true;
  }
  return false;
}

// What twice the precision says, where double is too coarse.
std::optional<TriangleHit> TriangleRay::edge_on_test(const Triangle& triangle, const Seen& seen) const {
  if (is_exactly_edge_on(triangle) || seen.is_far_beside()) return std::nullopt;
  // Rounding on the way into the projection may open a triangle without area.
  if (area_normal(triangle) == Vec3d{}) return std::nullopt;
  StoredRay ray = stored_;
  ray.direction = scaled(ray.direction, exponent_);
  const bool hit_in_double = !seen.is_beside() && seen.determinant != 0;
  const std::optional<EdgeOnHit> hit = edge_on_hit(ray, triangle, cull_, {hit_in_double, seen.blur()});
  if (!hit) return std::nullopt;
  return hit_of(hit->t, hit->u, hit->v);
}

std::optional<TriangleHit> TriangleRay::edge_test(const Triangle& triangle) const {
  const Seen seen = see(triangle);
  if (seen.is_nearly_edge_on() && !planted(PlantedBug::kEdgeOnInDouble)) return edge_on_test(triangle, seen);
  if (seen.is_beside() || culled(cull_, seen.determinant)) return std::nullopt;
  const double depth = seen.weight_a * seen.a.z + seen.weight_b * seen.b.z + seen.weight_c * seen.c.z;
  double t = depth / (seen.determinant * direction_[axis_z_]);
  if (!(t >= 0)) {
    // Whether a ray from the triangle's own plane starts before it or behind it is rounding: it starts on it.
    if (!(std::abs(depth) <= depth_noise(triangle))) return std::nullopt;
    t = 0;
  }
  return hit_of(t, seen.weight_b / seen.determinant, seen.weight_c / seen.determinant);
}

std::optional<TriangleHit> TriangleRay::hit(const Triangle& triangle) const {
  std::optional<TriangleHit> result = edge_test(triangle);
  if (!result) return std::nullopt;
  const Interval<float> own = slabs_.interval(bounds_of(triangle));
  if (!(own.near <= own.far) || own.far < 0) return std::nullopt;
  result->t = std::min(std::max(result->t, own.near), own.far);
  return result;
}

}  // namespace locus
