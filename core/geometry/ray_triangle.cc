#include "core/geometry/ray_triangle.h"

#include <cmath>
#include <utility>

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

}  // namespace

TriangleRay::TriangleRay(Vec3d origin, Vec3d direction, Cull cull)
    : exponent_(exponent_of(direction)),
      origin_(origin),
      direction_(scaled(direction, exponent_)),
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
  const double scaled = std::ldexp(static_cast<double>(std::nextafter(t, kInfinity)), exponent_);
  if (scaled >= std::numeric_limits<float>::max()) return kInfinity;
  return std::nextafter(static_cast<float>(scaled), kInfinity);
}

// Bounds the rounding of `depth` in edge_test(): under 264 roundings of 2^-53 of reach^3 on the way from the vertices,
// and 72 of 2^-51 of |origin| reach^2 for the origin's own way into mesh axes.
double TriangleRay::depth_noise(Vec3d a, Vec3d b, Vec3d c) const {
  const double reach = max_component(max(abs(a), max(abs(b), abs(c))));
  return 0x1p-44 * reach * reach * (reach + max_component(abs(origin_)));
}

std::optional<TriangleHit> TriangleRay::edge_test(const Triangle& triangle) const {
  const Vec3d a = to_double(triangle.a) - origin_;
  const Vec3d b = to_double(triangle.b) - origin_;
  const Vec3d c = to_double(triangle.c) - origin_;
  const double dx = direction_[axis_x_], dy = direction_[axis_y_], dz = direction_[axis_z_];
  const double ax = a[axis_x_] * dz - a[axis_z_] * dx, ay = a[axis_y_] * dz - a[axis_z_] * dy;
  const double bx = b[axis_x_] * dz - b[axis_z_] * dx, by = b[axis_y_] * dz - b[axis_z_] * dy;
  const double cx = c[axis_x_] * dz - c[axis_z_] * dx, cy = c[axis_y_] * dz - c[axis_z_] * dy;
  const double weight_a = cx * by - cy * bx;
  const double weight_b = ax * cy - ay * cx;
  const double weight_c = bx * ay - by * ax;
  const bool any_negative = weight_a < 0 || weight_b < 0 || weight_c < 0;
  const bool any_positive = weight_a > 0 || weight_b > 0 || weight_c > 0;
  if (any_negative && any_positive) return std::nullopt;
  const double determinant = weight_a + weight_b + weight_c;
  // Rounding on the way into the projection may open a triangle without area.
  if (determinant == 0 || area_normal(triangle) == Vec3d{}) return std::nullopt;
  if (culled(cull_, determinant)) return std::nullopt;
  const double depth = weight_a * a[axis_z_] + weight_b * b[axis_z_] + weight_c * c[axis_z_];
  double t = depth / (determinant * dz);
  if (!(t >= 0)) {
    // Whether a ray from the triangle's own plane starts before it or behind it is rounding: it starts on it.
    if (!(std::abs(depth) <= depth_noise(a, b, c))) return std::nullopt;
    t = 0;
  }
  // The sum turns -0 into 0, so that equal answers have equal bytes.
  return TriangleHit{static_cast<float>(t) + 0.0f, static_cast<float>(weight_b / determinant),
                     static_cast<float>(weight_c / determinant)};
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
