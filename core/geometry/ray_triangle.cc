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

Rayf scaled_ray(Vec3d origin, Vec3d direction, int exponent) {
  const Vec3d scaled = {std::ldexp(direction.x, -exponent), std::ldexp(direction.y, -exponent),
                        std::ldexp(direction.z, -exponent)};
  return {to_float(origin), to_float(scaled)};
}

bool culled(Cull cull, float determinant) {
  if (cull == Cull::kNone) return false;
  const bool front = determinant > 0;
  return cull == Cull::kBack ? !front : front;
}

}  // namespace

TriangleRay::TriangleRay(Vec3d origin, Vec3d direction, Cull cull)
    : slabs_(scaled_ray(origin, direction, exponent_of(direction)), kTrianglePad),
      exponent_(exponent_of(direction)),
      cull_(cull) {
  const Vec3f d = slabs_.direction();
  const Vec3f size = abs(d);
  axis_z_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  axis_x_ = (axis_z_ + 1) % 3;
  axis_y_ = (axis_z_ + 2) % 3;
  // Keeps the winding: seen along the ray, x to y always turns the same way.
  if (d[axis_z_] < 0) std::swap(axis_x_, axis_y_);
  shear_x_ = d[axis_x_] / d[axis_z_];
  shear_y_ = d[axis_y_] / d[axis_z_];
  shear_z_ = 1.0f / d[axis_z_];
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

std::optional<TriangleHit> TriangleRay::edge_test(const Triangle& triangle) const {
  const Vec3f a = triangle.a - slabs_.origin();
  const Vec3f b = triangle.b - slabs_.origin();
  const Vec3f c = triangle.c - slabs_.origin();
  const float ax = a[axis_x_] - shear_x_ * a[axis_z_], ay = a[axis_y_] - shear_y_ * a[axis_z_];
  const float bx = b[axis_x_] - shear_x_ * b[axis_z_], by = b[axis_y_] - shear_y_ * b[axis_z_];
  const float cx = c[axis_x_] - shear_x_ * c[axis_z_], cy = c[axis_y_] - shear_y_ * c[axis_z_];
  const float weight_a = cx * by - cy * bx;
  const float weight_b = ax * cy - ay * cx;
  const float weight_c = bx * ay - by * ax;
  const bool any_negative = weight_a < 0 || weight_b < 0 || weight_c < 0;
  const bool any_positive = weight_a > 0 || weight_b > 0 || weight_c > 0;
  if (any_negative && any_positive) return std::nullopt;
  const float determinant = weight_a + weight_b + weight_c;
  if (determinant == 0) return std::nullopt;
  if (culled(cull_, determinant)) return std::nullopt;
  const float depth =
      weight_a * (shear_z_ * a[axis_z_]) + weight_b * (shear_z_ * b[axis_z_]) + weight_c * (shear_z_ * c[axis_z_]);
  return TriangleHit{depth / determinant, weight_b / determinant, weight_c / determinant};
}

std::optional<TriangleHit> TriangleRay::hit(const Triangle& triangle) const {
  std::optional<TriangleHit> result = edge_test(triangle);
  if (!result || !(result->t >= 0)) return std::nullopt;
  const Interval<float> own = slabs_.interval(bounds_of(triangle));
  if (!(own.near <= own.far) || own.far < 0) return std::nullopt;
  result->t = std::min(std::max(result->t, own.near), own.far);
  return result;
}

}  // namespace locus
