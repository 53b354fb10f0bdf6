#include "core/geometry/point_in_mesh.h"

#include <algorithm>
#include <cmath>

#include "core/base/planted_bug.h"
#include "core/geometry/exact_sum.h"

namespace locus {
namespace {

// Bounds of the errors of an area and of a volume, relative to the sums of the magnitudes of their products.
constexpr double kAreaBound = 0x1p-50, kVolumeBound = 0x1p-49;

int sign_of(double value) { return (value > 0) - (value < 0); }

// Returns corner - point, exactly.
DoubleDouble difference(double corner, double point) { return DoubleDouble(corner) - DoubleDouble(point); }

// Adds factor * a * b to `sum`, exactly. `factor` is 1 or -1.
template <int kMaxSummands>
void add_product(DoubleDouble a, DoubleDouble b, double factor, ExactSum<kMaxSummands>& sum) {
  for (const double x : {a.error(), a.rounded()})
    for (const double y : {b.error(), b.rounded()})
      if (x != 0 && y != 0) sum.add(DoubleDouble(x) * DoubleDouble(factor * y));
}

// Returns the sign of the area of the triangle (u, v, point), projected along `axis`: 1 if it is counter-clockwise.
__attribute__((noinline)) int exact_orientation(Vec3d point, Vec3d u, Vec3d v, int axis) {
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  ExactSum<16> sum;
  add_product(difference(u[x], point[x]), difference(v[y], point[y]), 1, sum);
  add_product(difference(u[y], point[y]), difference(v[x], point[x]), -1, sum);
  return sum.sign();
}

// Returns the same as exact_orientation(), computed in double if the sign is certain. `from_u` and `from_v` are u -
// point and v - point, rounded to double. Each of these differences, each product and the final subtraction round once;
// together they change the area by at most 2^-51 of the magnitudes of the two products. If both products are 0, the
// area is exactly 0, because a product is 0 only if one of its factors is 0.
int orientation(Vec3d point, Vec3d u, Vec3d v, Vec3d from_u, Vec3d from_v, int axis) {
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const double left = from_u[x] * from_v[y], right = from_u[y] * from_v[x], area = left - right;
  const double magnitude = std::abs(left) + std::abs(right);
  if (std::abs(area) > kAreaBound * magnitude || planted(PlantedBug::kCrossingInDouble)) return sign_of(area);
  return magnitude == 0 ? 0 : exact_orientation(point, u, v, axis);
}

// Returns the sign of the volume (a - point) . ((b - point) x (c - point)).
__attribute__((noinline)) int exact_side(Vec3d point, const Corners& corners) {
  ExactSum<192> sum;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3d a = corners[i], b = corners[(i + 1) % 3], c = corners[(i + 2) % 3];
    const DoubleDouble along = difference(a.x, point.x);
    for (const double x : {along.error(), along.rounded()}) {
      if (x == 0) continue;
      const auto add = [&](DoubleDouble y, DoubleDouble z, double sign) {
        for (const double p : {y.error(), y.rounded()}) {
          const DoubleDouble product = DoubleDouble(x) * DoubleDouble(sign * p);
          add_product(product, z, 1, sum);
        }
      };
      add(difference(b.y, point.y), difference(c.z, point.z), 1);
      add(difference(b.z, point.z), difference(c.y, point.y), -1);
    }
  }
  return sum.sign();
}

// Returns the same as exact_side(): 1 if the triangle appears clockwise from the point, that is, if the point is
// behind the triangle. Computes in double if the error bound proves the sign, otherwise exactly. `from` has the
// differences of the corners from the point, rounded to double. Each summand has eight roundings: three differences,
// the product of two of them, the subtraction of two such products, the product with the third difference, and two
// sums. Together these roundings change a summand by at most 2^-50 of its magnitude.
int side(Vec3d point, const Corners& corners, const Vec3d (&from)[3]) {
  const Vec3d a = from[0], b = from[1], c = from[2];
  const double yz[3] = {b.y * c.z, c.y * a.z, a.y * b.z}, zy[3] = {b.z * c.y, c.z * a.y, a.z * b.y};
  const double volume = a.x * (yz[0] - zy[0]) + b.x * (yz[1] - zy[1]) + c.x * (yz[2] - zy[2]);
  const double magnitude = std::abs(a.x) * (std::abs(yz[0]) + std::abs(zy[0])) +
                           std::abs(b.x) * (std::abs(yz[1]) + std::abs(zy[1])) +
                           std::abs(c.x) * (std::abs(yz[2]) + std::abs(zy[2]));
  if (std::abs(volume) > kVolumeBound * magnitude || planted(PlantedBug::kCrossingInDouble)) return sign_of(volume);
  return magnitude == 0 ? 0 : exact_side(point, corners);
}

// Returns whether `point` lies on the triangle. Precondition: the point lies in the triangle's plane and within the
// triangle's bounds. The point lies on the triangle if it is inside the triangle in all three projections. This is also
// true for a triangle without area, which is a segment or a point. Its edges run along the segment in both directions,
// so if the point is off the segment but within its bounds, the signs of these edges differ in some projection.
bool is_inside(Vec3d point, const Corners& corners, const Vec3d (&from)[3]) {
  for (int axis = 0; axis < 3; ++axis) {
    int least = 1, most = -1;
    for (size_t i = 0; i < 3; ++i) {
      const size_t next = i == 2 ? 0 : i + 1;
      const int sign = orientation(point, corners[i], corners[next], from[i], from[next], axis);
      least = std::min(least, sign);
      most = std::max(most, sign);
    }
    if (least < 0 && most > 0) return false;
  }
  return true;
}

// Returns the winding of the triangle, projected along the x axis, around the point. Computes exact signs, but only for
// edges whose range of y contains the point.
__attribute__((noinline)) int exact_projected_winding(Vec3d point, const Corners& corners, const Vec3d (&from)[3]) {
  int winding = 0;
  for (size_t i = 0; i < 3; ++i) {
    const size_t next = i == 2 ? 0 : i + 1;
    // An edge includes its lower end but not its upper end. `u` and `v` are rounded, but their signs are exact.
    const double u = from[i].y, v = from[next].y;
    const bool closed = planted(PlantedBug::kClosedEdge);
    const bool rises = u <= 0 && (closed ? v >= 0 : v > 0), falls = v <= 0 && (closed ? u >= 0 : u > 0);
    if (!rises && !falls) continue;
    const int sign = orientation(point, corners[i], corners[next], from[i], from[next], 0);
    winding += (rises && sign > 0 ? 1 : 0) - (falls && sign < 0 ? 1 : 0);
  }
  return winding;
}

// Returns the same as exact_projected_winding(), but computes in double and without branches if all signs are certain.
int projected_winding(Vec3d point, const Corners& corners, const Vec3d (&from)[3]) {
  if (planted(PlantedBug::kClosedEdge)) return exact_projected_winding(point, corners, from);
  int winding = 0;
  bool certain = true;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3d u = from[i], v = from[i == 2 ? 0 : i + 1];
    const double left = u.y * v.z, right = u.z * v.y, area = left - right;
    certain &= std::abs(area) > kAreaBound * (std::abs(left) + std::abs(right));
    const int rises = (u.y <= 0) & (v.y > 0), falls = (v.y <= 0) & (u.y > 0);
    winding += (rises & (area > 0)) - (falls & (area < 0));
  }
  return certain ? winding : exact_projected_winding(point, corners, from);
}

// Returns the point or vertex `at` in axes in which `line` ascends along the x axis. The axes are rotated and, if
// `line` is descending, also mirrored.
template <class Vec>
Vec along_x(Vec at, HalfLine line) {
  const auto along = at[line.axis];
  return {line.descending ? -along : along, at[(line.axis + 1) % 3], at[(line.axis + 2) % 3]};
}

}  // namespace

Crossing crossing(Vec3d point, const Triangle& triangle) {
  const Aabbf bounds = bounds_of(triangle);
  if (point.y < bounds.min.y || point.y > bounds.max.y || point.z < bounds.min.z || point.z > bounds.max.z ||
      point.x > bounds.max.x)
    return {};
  const Corners corners = corners_of(triangle);
  const Vec3d from[3] = {corners[0] - point, corners[1] - point, corners[2] - point};
  const int winding = projected_winding(point, corners, from);
  if (point.x < bounds.min.x) return {winding, false};
  const int behind = side(point, corners, from);
  // The point is in the triangle's plane. Even if `winding` is 0, the point may be on the triangle: on an edge or a
  // corner that is not counted, or on a triangle parallel to the half line.
  if (behind == 0) return {0, is_inside(point, corners, from)};
  return {winding * behind > 0 ? winding : 0, false};
}

Crossing crossing(Vec3d point, const Triangle& triangle, HalfLine line) {
  const Triangle along{along_x(triangle.a, line), along_x(triangle.b, line), along_x(triangle.c, line), 0};
  Crossing found = crossing(along_x(point, line), along);
  // The mirror image of a triangle is clockwise if the triangle is counter-clockwise.
  if (line.descending && !planted(PlantedBug::kCrossingMirror)) found.winding = -found.winding;
  return found;
}

}  // namespace locus
