#include "core/geometry/ray_triangle.h"

#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
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

// Corner of a triangle relative to the ray's origin, sheared so that the ray becomes the z axis. x and y are also
// multiplied by the z component of the direction; z is the depth.
struct Corner {
  double x, y, z;
};

double max_offset(Corner corner) { return std::max(std::abs(corner.x), std::abs(corner.y)); }
double min3(double a, double b, double c) { return std::min(a, std::min(b, c)); }
double max3(double a, double b, double c) { return std::max(a, std::max(b, c)); }

// Returns the hit in float. Adding 0.0f converts -0 to 0, so that equal answers have equal bytes.
TriangleHit hit_of(double t, double u, double v) {
  return {static_cast<float>(t) + 0.0f, static_cast<float>(u), static_cast<float>(v)};
}

}  // namespace

// Projection of a triangle along the ray, in double. Error bounds, with u = 2^-53, R = max |origin| + max |vertex|, S =
// `size` and N = a bound of the error of an edge function:
//
// - The transform to mesh axes, including the rounding of the matrix, has a relative error below 74 u in origin and
//   direction. So the error of a sheared coordinate is below 300 u R. An edge function consists of two products of
//   coordinates up to S, so its error is below N = 2^-42 R (S + 2^-44 R).
// - The depth of a hit is the average of the corners' depths, weighted by the edge functions. If |determinant| > 8 N,
//   the error of the depth is below 3 N depth_span / |determinant|, and the error of the hit below sqrt(3) times the
//   error of the depth.
struct TriangleRay::Projected {
  Corner a, b, c;
  double weight_a, weight_b, weight_c;  // the edge functions
  double min_weight, max_weight;
  double determinant;
  double size;        // S: largest |x| or |y| of a corner
  double depth_span;  // largest minus smallest depth
  double magnitude;   // upper bound of R: no vertex is farther from the ray's origin than 2 S + max |depth|

  // Returns whether the triangle is so nearly edge-on that double is not precise enough. For all other triangles the
  // error of the hit is below 2^-23 R.
  bool is_nearly_edge_on() const {
    return std::abs(determinant) <= (size + 0x1p-44 * magnitude) * (0x1p-16 * depth_span + 0x1p-39 * magnitude);
  }
  // Returns whether the ray passes outside the triangle.
  bool is_outside() const { return min_weight < 0 && max_weight > 0; }
  // Returns a bound of the rounding error of a corner. The error is below 2^-44.8 * magnitude in each coordinate.
  double corner_error() const { return 0x1p-43 * magnitude; }
  // Returns whether the ray passes outside the triangle by more than the error bounds above.
  bool is_clearly_outside() const {
    const double weight_error = 0x1p-42 * magnitude * (size + 0x1p-44 * magnitude);
    if (min_weight < -weight_error && max_weight > weight_error) return true;
    return max3(min3(a.x, b.x, c.x), min3(a.y, b.y, c.y), 0) > corner_error() ||
           min3(max3(a.x, b.x, c.x), max3(a.y, b.y, c.y), 0) < -corner_error();
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
      origin_magnitude_(max_component(abs(origin))),
      slabs_({to_float(origin_), to_float(direction_)}, kTrianglePad),
      cull_(cull) {
  const Vec3d size = abs(direction_);
  LOCUS_DCHECK_GE(max_component(size), 0.5);
  LOCUS_DCHECK_LT(max_component(size), 1.0);
  axis_z_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  axis_x_ = (axis_z_ + 1) % 3;
  axis_y_ = (axis_z_ + 2) % 3;
  // Swaps x and y for a negative direction, so that a front face has the same orientation in every projection.
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

// Returns a bound of the error of the variable `depth` in edge_test(). The bound covers two sums of rounding errors:
// below 264 * 2^-53 * distance^3 from the computation with the vertices, and below 72 * 2^-51 * |origin| * distance^2
// from the transform of the origin to mesh axes.
double TriangleRay::depth_error(const Triangle& triangle) const {
  double distance = 0;
  for (const Vec3f vertex : {triangle.a, triangle.b, triangle.c})
    distance = std::max(distance, max_component(abs(to_double(vertex) - origin_)));
  return 0x1p-44 * distance * distance * (distance + origin_magnitude_);
}

TriangleRay::Projected TriangleRay::project(const Triangle& triangle) const {
  const double dx = direction_[axis_x_], dy = direction_[axis_y_], dz = direction_[axis_z_];
  const auto corner = [&](Vec3f vertex) {
    const Vec3d from = to_double(vertex) - origin_;
    const double z = from[axis_z_];
    return Corner{from[axis_x_] * dz - z * dx, from[axis_y_] * dz - z * dy, z};
  };
  Projected projected;
  const Corner a = projected.a = corner(triangle.a), b = projected.b = corner(triangle.b),
               c = projected.c = corner(triangle.c);
  projected.weight_a = c.x * b.y - c.y * b.x;
  projected.weight_b = a.x * c.y - a.y * c.x;
  projected.weight_c = b.x * a.y - b.y * a.x;
  projected.min_weight = min3(projected.weight_a, projected.weight_b, projected.weight_c);
  projected.max_weight = max3(projected.weight_a, projected.weight_b, projected.weight_c);
  projected.determinant = projected.weight_a + projected.weight_b + projected.weight_c;
  projected.size = max3(max_offset(a), max_offset(b), max_offset(c));
  const double nearest = min3(a.z, b.z, c.z), farthest = max3(a.z, b.z, c.z);
  projected.depth_span = farthest - nearest;
  projected.magnitude = 2 * (origin_magnitude_ + projected.size + std::max(-nearest, farthest));
  return projected;
}

// Returns true if, on one of the axes, the direction is 0 and all vertices have the same coordinate: the ray is then
// exactly parallel to the triangle's plane. Tested only for meshes without rotation, since a rotation would round the
// zero component of the direction.
bool TriangleRay::is_exactly_edge_on(const Triangle& triangle) const {
  if (!stored_.quaternion.is_identity()) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const float plane = triangle.a[axis];
    if (direction_[axis] == 0 && triangle.b[axis] == plane && triangle.c[axis] == plane) return true;
  }
  return false;
}

// Returns the hit on a nearly edge-on triangle, computed in extended precision.
std::optional<TriangleHit> TriangleRay::edge_on_test(const Triangle& triangle, const Projected& projected) const {
  if (is_exactly_edge_on(triangle) || projected.is_clearly_outside()) return std::nullopt;
  // A triangle without area is never hit, but rounding errors of the projection may give it a nonzero determinant.
  if (area_normal(triangle) == Vec3d{}) return std::nullopt;
  StoredRay ray = stored_;
  ray.direction = scaled(ray.direction, exponent_);
  const bool hit_in_double = !projected.is_outside() && projected.determinant != 0;
  const std::optional<EdgeOnHit> hit = edge_on_hit(ray, triangle, cull_, {hit_in_double, projected.corner_error()});
  if (!hit) return std::nullopt;
  return hit_of(hit->t, hit->u, hit->v);
}

std::optional<TriangleHit> TriangleRay::edge_test(const Triangle& triangle) const {
  const Projected projected = project(triangle);
  if (projected.is_nearly_edge_on() && !planted(PlantedBug::kEdgeOnInDouble)) return edge_on_test(triangle, projected);
  if (projected.is_outside() || culled(cull_, projected.determinant)) return std::nullopt;
  const double depth =
      projected.weight_a * projected.a.z + projected.weight_b * projected.b.z + projected.weight_c * projected.c.z;
  double t = depth / (projected.determinant * direction_[axis_z_]);
  if (!(t >= 0)) {
    // The ray starts on the triangle if the depth is within its error bound.
    if (!(std::abs(depth) <= depth_error(triangle))) return std::nullopt;
    t = 0;
  }
  return hit_of(t, projected.weight_b / projected.determinant, projected.weight_c / projected.determinant);
}

std::optional<TriangleHit> TriangleRay::hit(const Triangle& triangle) const {
  std::optional<TriangleHit> result = edge_test(triangle);
  if (!result) return std::nullopt;
  const Interval<float> own = slabs_.interval(bounds_of(triangle));
  if (!(own.near <= own.far) || own.far < 0) return std::nullopt;
  result->t = std::min(std::max(result->t, own.near), own.far);
  LOCUS_DCHECK_GE(result->t, 0.0f);
  return result;
}

}  // namespace locus
