// Octree: divides space at the middle of the extent of the values, on any one, two or three axes at once, for values of
// any size and of uneven density. Divided on one axis it is an interval tree, on two a quadtree.
//
// Threads: const members may run concurrently; insert, remove and rebuild need exclusive use.
// Invariants: Planes divide a part of space into closed parts. A value lies below a plane if its bounds begin at or
// below the plane, and above if they end above the plane. A value that is on both sides of a plane lies in the leaves
// of all parts that it touches or, with CutValues::kAtNode, at the node. The bounds of the tree contain all values.
// After a build, nodes < 2n and references < 4n for n > 0 values, and no leaf is deeper than the options allow. No
// visit loses a value. Comparisons with planes are exact, and a query that touches a plane opens both sides. A plane
// has a padded interval on a ray, as if it were a flat box: the part before it ends at the interval's far value, and
// the part behind it begins at the near value. If a value's own interval contains t >= 0, so does that of one of the
// parts in which it lies, because each interval is computed by steps that are monotone in the coordinates and the parts
// of a node leave no gap. Distances to parts are computed by the same monotone steps as those to the bounds of values.
// Source: Finkel and Bentley, Quad Trees: A Data Structure for Retrieval on Composite Keys, 1974; Meagher, Geometric
// Modeling Using Octree Encoding, 1982; Hughes et al., Computer Graphics: Principles and Practice, 3rd ed., 2013,
// ch. 37.
#ifndef LOCUS_CORE_INDEX_OCTREE_OCTREE_H_
#define LOCUS_CORE_INDEX_OCTREE_OCTREE_H_

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/cut_values.h"
#include "core/index/octree/octree_nodes.h"
#include "core/index/plane_tree.h"
#include "core/index/spatial_index.h"

namespace locus {

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class Octree : public PlaneTree<V, T, OctreeNodes<typename T::Scalar>> {
  using S = typename T::Scalar;
  using Base = PlaneTree<V, T, OctreeNodes<S>>;

 public:
  using Base::size, Base::bounds;

  // Makes an empty tree.
  explicit Octree(const OctreeOptions& options = {}) : Base(options) {}

  // Builds a tree of `values`. Preconditions: their ids are unique, and their bounds are finite and not empty.
  // O(n log n) unless their distances differ by many powers of two; at most O(n * depth).
  static Octree build(std::vector<V> values, const OctreeOptions& options = {}) {
    Octree tree(options);
    tree.fill(std::move(values));
    return tree;
  }

  // Passes candidates to `visitor` leaf by leaf, in the order in which the ray enters the leaves. Only values whose own
  // bounds the ray enters before the limit are passed.
  template <RayVisitor<V, T> Visitor>
  void visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const;

  // Passes to `visitor` the values whose own bounds visitor.overlaps() accepts.
  template <RegionVisitor<V, T> Visitor>
  void visit_region(Visitor& visitor, Work& work) const;

  // Passes to `visitor` the values whose own bounds have a squared distance of at most visitor.limit() from `point`,
  // roughly nearest first: the part in which the point lies precedes the other parts of a node.
  template <PointVisitor<V, T> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const;

 private:
  using Base::nodes, Base::pass_values;
  using Node = OctreeNode<S>;
  template <class Pending>
  using Stack = typename OctreeNodes<S>::template Stack<Pending>;
  static constexpr size_t kStackSize = OctreeNodes<S>::kStackSize;
  static constexpr S kInfinity = std::numeric_limits<S>::infinity();
};

template <class V, class T>
requires Bounded<V, T>
template <RayVisitor<V, T> Visitor>
void Octree<V, T>::visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const {
  struct Pending {
    uint32_t node;
    S near, far;  // interval of the ray in the node's part of space
  };
  if (size() == 0) return;
  if (planted(PlantedBug::kOctreeRayFromInside) && !locus::contains(bounds(), slabs.origin())) return;
  // The interval of a value may begin before the origin, so the limit of parts is not negative.
  const auto beyond = [&](S near) {
    return !planted(PlantedBug::kOctreeRayToBorder) && near > std::max(visitor.limit(), S{0});
  };
  const auto wanted = [&](const Aabb<S>& own) {
    const Interval<S> interval = slabs.interval(own);
    return interval.near <= interval.far && interval.far >= 0 && interval.near <= visitor.limit();
  };
  const S magnitude = planted(PlantedBug::kOctreeRayUnpadded) ? S{0} : locus::magnitude(bounds());
  const absl::Span<const int> axes = nodes().axes();
  uint32_t backwards = 0;  // the child that a ray enters first if it crosses all planes: the sign bits of the direction
  for (size_t i = 0; i < axes.size(); ++i) backwards |= uint32_t{std::signbit(slabs.direction()[axes[i]])} << i;
  PassedValues passed;
  const Interval<S> whole = slabs.interval(bounds(), magnitude);
  Stack<Pending> pending = {{0, whole.near, whole.far}};
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    // The limit may have decreased since the push.
    if (now.near > now.far || now.far < 0 || beyond(now.near)) continue;
    ++work.nodes;
    const Node& node = nodes()[now.node];
    if (!pass_values(node, wanted, visitor, passed, work)) return;
    if (node.is_leaf()) continue;
    Interval<S> planes[3];
    for (size_t i = 0; i < axes.size(); ++i) {
      Aabb<S> plane = {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
      plane.min[axes[i]] = plane.max[axes[i]] = node.middle[axes[i]];
      planes[i] = slabs.interval(plane, magnitude);
    }
    for (uint32_t order = nodes().child_count(); order-- > 0;) {
      Pending child = {node.first_child + (order ^ backwards), now.near, now.far};
      for (size_t i = 0; i < axes.size(); ++i) {
        const bool behind = ((order >> i) & 1) != 0;
        if (behind) child.near = std::max(child.near, planes[i].near);
        if (!behind) child.far = std::min(child.far, planes[i].far);
      }
      if (child.near <= child.far && child.far >= 0 && !beyond(child.near)) pending.push_back(child);
    }
    LOCUS_DCHECK_LE(pending.size(), kStackSize);
  }
}

template <class V, class T>
requires Bounded<V, T>
template <RegionVisitor<V, T> Visitor>
void Octree<V, T>::visit_region(Visitor& visitor, Work& work) const {
  const Aabb<S> box = visitor.bounds();
  if (!overlaps(box, bounds())) return;
  const auto wanted = [&](const Aabb<S>& own) { return visitor.overlaps(own); };
  const absl::Span<const int> axes = nodes().axes();
  PassedValues passed;
  Stack<uint32_t> pending = {0};
  while (!pending.empty()) {
    const Node& node = nodes()[pending.back()];
    pending.pop_back();
    ++work.nodes;
    if (!pass_values(node, wanted, visitor, passed, work)) return;
    if (node.is_leaf()) continue;
    uint32_t below = 0, above = 0;  // sides of the planes that the region touches
    for (size_t i = 0; i < axes.size(); ++i) {
      const S plane = node.middle[axes[i]], low = box.min[axes[i]];
      if (planted(PlantedBug::kOctreeLowerStrict) ? low < plane : low <= plane) below |= 1u << i;
      if (box.max[axes[i]] >= plane) above |= 1u << i;
    }
    for (uint32_t child = nodes().child_count(); child-- > 0;) {
      const uint32_t other = ~child & (nodes().child_count() - 1);
      if ((child & ~above) == 0 && (other & ~below) == 0) pending.push_back(node.first_child + child);
    }
    LOCUS_DCHECK_LE(pending.size(), kStackSize);
  }
}

template <class V, class T>
requires Bounded<V, T>
template <PointVisitor<V, T> Visitor>
void Octree<V, T>::visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
  struct Pending {
    uint32_t node;
    Vec3d gap;  // distance from the point to the node's part of space on each axis; 0 within
  };
  if (size() == 0) return;
  const auto beyond = [&](double distance) {
    return planted(PlantedBug::kOctreeNearestStrict) ? distance >= visitor.limit() : distance > visitor.limit();
  };
  const auto wanted = [&](const Aabb<S>& own) { return squared_distance(point, to_double(own)) <= visitor.limit(); };
  const absl::Span<const int> axes = nodes().axes();
  PassedValues passed;
  const Aabbd whole = to_double(bounds());
  Stack<Pending> pending = {{0, max(max(whole.min - point, point - whole.max), Vec3d{})}};
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    if (beyond(squared_length(now.gap))) continue;
    ++work.nodes;
    const Node& node = nodes()[now.node];
    if (!pass_values(node, wanted, visitor, passed, work)) return;
    if (node.is_leaf()) continue;
    uint32_t nearest = 0;  // number of the child on whose sides of the planes the point lies
    Vec3d gaps;            // distances to the planes
    for (size_t i = 0; i < axes.size(); ++i) {
      const double offset = point[axes[i]] - double{node.middle[axes[i]]};
      nearest |= uint32_t{offset > 0} << i;
      gaps[axes[i]] = std::abs(offset);
    }
    for (uint32_t order = nodes().child_count(); order-- > 0;) {
      Pending child = {node.first_child + (order ^ nearest), now.gap};
      for (size_t i = 0; i < axes.size(); ++i) {
        if (((order >> i) & 1) != 0) child.gap[axes[i]] = std::max(child.gap[axes[i]], gaps[axes[i]]);
      }
      if (!beyond(squared_length(child.gap))) pending.push_back(child);
    }
    LOCUS_DCHECK_LE(pending.size(), kStackSize);
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_OCTREE_OCTREE_H_
