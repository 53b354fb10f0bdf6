// Axis-aligned bounding boxes. A box is closed: boxes that touch overlap. Plain data; an empty() box contains nothing
// and is the neutral element of merge(). Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_AABB_H_
#define LOCUS_CORE_GEOMETRY_AABB_H_

#include <limits>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/vec3.h"

namespace locus {

template <class S>
struct Aabb {
  static constexpr S kInfinity = std::numeric_limits<S>::infinity();

  Vec3<S> min{kInfinity, kInfinity, kInfinity};
  Vec3<S> max{-kInfinity, -kInfinity, -kInfinity};

  constexpr bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
  constexpr Vec3<S> extent() const { return max - min; }
  friend constexpr bool operator==(const Aabb&, const Aabb&) = default;
};

using Aabbf = Aabb<float>;
using Aabbd = Aabb<double>;

// Returns the smallest box that contains both arguments.
template <class S>
constexpr Aabb<S> merge(const Aabb<S>& a, const Aabb<S>& b) {
  return {min(a.min, b.min), max(a.max, b.max)};
}

template <class S>
constexpr Aabb<S> merge(const Aabb<S>& a, Vec3<S> point) {
  return {min(a.min, point), max(a.max, point)};
}

template <class S>
constexpr bool overlaps(const Aabb<S>& a, const Aabb<S>& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y && a.min.z <= b.max.z &&
         b.min.z <= a.max.z;
}

template <class S>
constexpr bool contains(const Aabb<S>& outer, const Aabb<S>& inner) {
  return outer.min.x <= inner.min.x && outer.min.y <= inner.min.y && outer.min.z <= inner.min.z &&
         inner.max.x <= outer.max.x && inner.max.y <= outer.max.y && inner.max.z <= outer.max.z;
}

template <class S>
constexpr bool contains(const Aabb<S>& box, Vec3<S> point) {
  return contains(box, Aabb<S>{point, point});
}

// Returns half the surface area, the cost measure of the surface area heuristic; 0 for an empty box.
template <class S>
constexpr S half_area(const Aabb<S>& box) {
  if (box.empty()) return S{0};
  const Vec3<S> e = box.extent();
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

// Returns the largest |coordinate| of any point of the box. A superset of the box never has a smaller magnitude.
template <class S>
S magnitude(const Aabb<S>& box) {
  return std::max(max_component(abs(box.min)), max_component(abs(box.max)));
}

// Returns the squared distance from `point` to the box; 0 if the box contains `point`. Each step rounds monotonically,
// so a superset of the box never has a larger squared distance.
template <class S>
constexpr S squared_distance(Vec3<S> point, const Aabb<S>& box) {
  const Vec3<S> gap = max(max(box.min - point, point - box.max), Vec3<S>{});
  return squared_length(gap);
}

// Returns an upper bound of all squared_distance() values whose rounded square root is at most `distance`. Boxes whose
// squared distance exceeds the bound can be pruned.
inline double squared_limit(double distance) {
  LOCUS_DCHECK_GE(distance, 0.0);
  if (planted(PlantedBug::kNearestLimit)) return distance * distance * (1 - 0x1p-50);
  return distance * distance * (1 + 0x1p-50);
}

// Returns the point of the box that is nearest to `point`. If the box contains `point`, this is `point` itself. The
// box must not be empty.
template <class S>
constexpr Vec3<S> nearest_in(Vec3<S> point, const Aabb<S>& box) {
  return min(max(point, box.min), box.max);
}

// Returns the box with all six faces moved outwards by the length `by`.
template <class S>
Aabb<S> grown(const Aabb<S>& box, S by) {
  const Vec3<S> offset{by, by, by};
  return {box.min - offset, box.max + offset};
}

template <class S>
constexpr Aabbd to_double(const Aabb<S>& box) {
  return {to_double(box.min), to_double(box.max)};
}

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_AABB_H_
