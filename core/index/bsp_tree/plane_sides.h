// Sides of a dividing plane: of boxes, points and rays, in double. The front of a plane is its half-space, normal.p +
// offset >= 0. A point on the plane is in front of it. Pure functions; any thread.
//
// Tests of boxes are conservative: a box counts as lying on a side unless it is beyond the plane by more than the bound
// of the rounding error. The signed distance of a corner has three products and three sums, so its error is less than
// 2^-51 of the sum of the |terms|; the bound is twice that, plus kUnderflow for products that underflow. Two boxes that
// share a point therefore always have a side in common, and so do all boxes that contain the point: the leaf of a point
// lists every value whose bounds contain the point, and a region that contains the point visits this leaf.
// Source: Fuchs, Kedem, Naylor, On Visible Surface Generation by A Priori Tree Structures, 1980.
#ifndef LOCUS_CORE_INDEX_BSP_TREE_PLANE_SIDES_H_
#define LOCUS_CORE_INDEX_BSP_TREE_PLANE_SIDES_H_

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/planted_bug.h"
#include "core/geometry/convex_region.h"
#include "core/index/padded_ray.h"

namespace locus {

inline constexpr double kUnderflow = 0x1p-500;  // more than the errors of products and squares that underflow

// Sides of a plane on which a box lies.
struct Sides {
  bool front, back;

  bool both() const { return front && back; }
};

inline double signed_distance(const Plane& plane, const Vec3d& point) {
  return dot(plane.normal, point) + plane.offset;
}

inline Sides sides_of(const Plane& plane, const Aabbd& box) {
  double low = plane.offset, high = plane.offset, size = std::abs(plane.offset);
  for (int axis = 0; axis < 3; ++axis) {
    const double a = plane.normal[axis] * box.min[axis], b = plane.normal[axis] * box.max[axis];
    low += std::min(a, b);
    high += std::max(a, b);
    size += std::max(std::abs(a), std::abs(b));
  }
  const double bound = 0x1p-50 * size + kUnderflow;
  if (planted(PlantedBug::kBspOnPlane)) return {high > bound || low >= -bound, low < -bound};
  return {!(high < -bound), !(low > bound)};  // a region without end, whose sums are NaN, lies on both sides
}

// Returns a lower bound of the squared_distance() from `point` to all boxes that lie only on the side of the plane that
// does not contain `point`.
inline double squared_distance_beyond(const Plane& plane, const Vec3d& point) {
  const double size = dot(abs(plane.normal), abs(point)) + std::abs(plane.offset);
  const double distance = std::abs(signed_distance(plane, point)) - (0x1p-50 * size + kUnderflow);
  return distance > 0 ? distance * distance * (1 - 0x1p-48) : 0;
}

// Spans of a ray on the two sides of a plane.
struct SideSpans {
  RaySpan front, back;
  bool front_first;  // the ray is in front before it is behind the plane
};

// Returns the spans, within `span`, of the padded ray on each side: at every distance outside of a span, the ray is
// farther from the side than pad(). Distances are lengths. The two spans overlap where the ray is near the plane.
inline SideSpans padded_spans(const Plane& plane, const PaddedRay& ray, RaySpan span) {
  const double start = signed_distance(plane, ray.origin()), slope = dot(plane.normal, ray.unit());
  // Restricts the span to start + t * slope >= -pad.
  const auto clip = [&ray](RaySpan clipped, double from, double rise) {
    const double crossing = (-ray.pad() - from) / rise;
    if (rise > 0) clipped.begin = std::max(clipped.begin, crossing);
    if (rise < 0) clipped.end = std::min(clipped.end, crossing);
    if (rise == 0 && from < -ray.pad()) clipped.end = -std::numeric_limits<double>::infinity();
    return clipped;
  };
  return {clip(span, start, slope), clip(span, -start, -slope), slope < 0 || (slope == 0 && start >= 0)};
}

// Returns the spans, within `span`, of the ray's own line on each side. Distances are in units of the ray's direction.
// The second span begins where the first one ends. At least one span is not empty, if `span` is not.
inline SideSpans exact_spans(const Plane& plane, const Rayd& ray, RaySpan span) {
  constexpr RaySpan kNowhere = {0, -1};
  const double start = signed_distance(plane, ray.origin), slope = dot(plane.normal, ray.direction);
  if (slope == 0) return start >= 0 ? SideSpans{span, kNowhere, true} : SideSpans{kNowhere, span, false};
  const double crossing = -start / slope;
  RaySpan first = kNowhere, second = kNowhere;
  if (crossing > span.begin) first = {span.begin, std::min(crossing, span.end)};
  if (!(crossing > span.begin) || crossing < span.end) second = {std::max(crossing, span.begin), span.end};
  return slope < 0 ? SideSpans{first, second, true} : SideSpans{second, first, false};
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BSP_TREE_PLANE_SIDES_H_
