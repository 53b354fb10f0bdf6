#include "core/geometry/point_in_mesh.h"

#include <cmath>
#include <utility>

#include "core/base/planted_bug.h"
#include "core/geometry/double_double.h"

namespace locus {
namespace {

int sign_of(double value) { return (value > 0) - (value < 0); }

// Returns the sign of the area of the triangle (u, v, point), projected along `axis`: 1 if it is counter-clockwise.
// Exchanging u and v exactly reverses the sign.
int orientation(Vec3d point, Vec3d u, Vec3d v, int axis) {
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  // Orders the ends equally for both triangles of an edge.
  const bool swapped = std::pair(u[x], u[y]) > std::pair(v[x], v[y]);
  if (swapped) std::swap(u, v);
  const double left = (u[x] - point[x]) * (v[y] - point[y]), right = (u[y] - point[y]) * (v[x] - point[x]);
  const double area = left - right;
  // Each factor has one rounding error, each product another, and the difference a last one.
  int sign = sign_of(area);
  if (!(std::abs(area) > 0x1p-50 * (std::abs(left) + std::abs(right)))) {
    using Number = DoubleDouble;
    const Number exact = (Number(u[x]) - Number(point[x])) * (Number(v[y]) - Number(point[y])) -
                         (Number(u[y]) - Number(point[y])) * (Number(v[x]) - Number(point[x]));
    sign = exact.sign();
  }
  return swapped ? -sign : sign;
}

// Returns the sign of the volume (a - point) . ((b - point) x (c - point)): 1 if the triangle appears clockwise from
// the point, that is, if the point is behind it.
int side(Vec3d point, const Corners& corners) {
  const Vec3d a = corners[0] - point, b = corners[1] - point, c = corners[2] - point;
  const double bc = b.y * c.z - b.z * c.y, ca = c.y * a.z - c.z * a.y, ab = a.y * b.z - a.z * b.y;
  const double volume = a.x * bc + b.x * ca + c.x * ab;
  const double magnitude = std::abs(a.x) * (std::abs(b.y * c.z) + std::abs(b.z * c.y)) +
                           std::abs(b.x) * (std::abs(c.y * a.z) + std::abs(c.z * a.y)) +
                           std::abs(c.x) * (std::abs(a.y * b.z) + std::abs(a.z * b.y));
  if (std::abs(volume) > 0x1p-49 * magnitude) return sign_of(volume);
  using Exact = Vec3<DoubleDouble>;
  const auto from = [&](Vec3d corner) {
    return Exact{DoubleDouble(corner.x) - DoubleDouble(point.x), DoubleDouble(corner.y) - DoubleDouble(point.y),
                 DoubleDouble(corner.z) - DoubleDouble(point.z)};
  };
  return dot(from(corners[0]), cross(from(corners[1]), from(corners[2]))).sign();
}

// Returns whether `point`, in the plane of the triangle, lies on the triangle: in each projection it is inside, and it
// lies within the bounds. For a triangle without area, which is a segment or a point, this decides too: off the
// segment, but within its bounds, the signs of the two directions differ in a projection.
bool is_inside(Vec3d point, const Corners& corners) {
  for (int axis = 0; axis < 3; ++axis) {
    const int ab = orientation(point, corners[0], corners[1], axis),
              bc = orientation(point, corners[1], corners[2], axis),
              ca = orientation(point, corners[2], corners[0], axis);
    if ((ab > 0 || bc > 0 || ca > 0) && (ab < 0 || bc < 0 || ca < 0)) return false;
  }
  return true;
}

// Returns the winding of the triangle, projected along the x axis, around the point.
int projected_winding(Vec3d point, const Corners& corners) {
  int winding = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec3d u = corners[static_cast<size_t>(i)], v = corners[static_cast<size_t>((i + 1) % 3)];
    // An edge includes its lower end and not its upper one.
    const bool closed = planted(PlantedBug::kClosedEdge);
    const bool rises = u.y <= point.y && (closed ? v.y >= point.y : v.y > point.y);
    const bool falls = v.y <= point.y && (closed ? u.y >= point.y : u.y > point.y);
    if (rises && orientation(point, u, v, 0) > 0) ++winding;
    if (falls && orientation(point, u, v, 0) < 0) --winding;
  }
  return winding;
}

}  // namespace

Vec3d without_tiny_coordinates(Vec3d point) {
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(point[axis]) < 0x1p-250) point[axis] = 0;
  return point;
}

Crossing crossing(Vec3d point, const Triangle& triangle) {
  const Aabbf bounds = bounds_of(triangle);
  if (point.y < bounds.min.y || point.y > bounds.max.y || point.z < bounds.min.z || point.z > bounds.max.z ||
      point.x > bounds.max.x)
    return {};
  const Corners corners = corners_of(triangle);
  const int winding = projected_winding(point, corners);
  if (point.x < bounds.min.x) return {winding, false};
  const int behind = side(point, corners);
  if (behind == 0) return {0, is_inside(point, corners)};
  return {winding * behind > 0 ? winding : 0, false};
}

}  // namespace locus
