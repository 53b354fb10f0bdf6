// kd tree: divides space by planes perpendicular to the axes, for values of any size. The options choose the axis and
// the position of each plane, and where the values lie that a plane cuts.
//
// Threads: const members may run concurrently; insert, remove and rebuild need exclusive use.
// Invariants: A plane divides a part of space into two closed parts. A value lies below the plane if its bounds begin
// at or below the plane, and above if they end above the plane; a value on both sides lies in the leaves of both or,
// with CutValues::kAtNode, at the node. The bounds of the tree contain all values. After a build, nodes < 2n and
// references < 4n for n > 0 values, and no leaf is deeper than the options allow. No visit loses a value. A box query
// has a point in common with the bounds of each result, and opens each closed part of space with such a point. The
// value lies in a leaf of that part, because a part is closed and the tests of planes are exact. For a ray and for a
// nearest query, each coordinate of a part is either that of a plane or that of the tree's bounds, and the interval or
// distance is computed by steps that are monotone in each coordinate: among the parts in which a value lies there is
// one whose near value or distance is at most that of the value. Source: Bentley, Multidimensional Binary Search Trees
// Used for Associative Searching, 1975; Hughes et al., Computer Graphics: Principles and Practice, 3rd ed., 2013, ch.
// 37 (BSP trees, kd trees); MacDonald and Booth, Heuristics for Ray Tracing Using Space Subdivision, 1990.
#ifndef LOCUS_CORE_INDEX_KD_TREE_KD_TREE_H_
#define LOCUS_CORE_INDEX_KD_TREE_KD_TREE_H_

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/cut_values.h"
#include "core/index/kd_tree/kd_nodes.h"
#include "core/index/plane_tree.h"
#include "core/index/spatial_index.h"

namespace locus {

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class KdTree : public PlaneTree<V, T, KdNodes<typename T::Scalar>> {
  using S = typename T::Scalar;
  using Base = PlaneTree<V, T, KdNodes<S>>;

 public:
  using Base::size, Base::bounds;

  // Makes an empty tree.
  explicit KdTree(const KdTreeOptions& options = {}) : Base(options) {}

  // Builds a tree of `values`. Preconditions: their ids are unique, and their bounds are finite and not empty.
  // O(n log n) if the planes divide the values evenly.
  static KdTree build(std::vector<V> values, const KdTreeOptions& options = {}) {
    KdTree tree(options);
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
  // roughly nearest first: the side of a plane on which the point lies precedes the other side.
  template <PointVisitor<V, T> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const;

 private:
  using Base::nodes, Base::pass_values;
  using Node = KdNode<S>;
  template <class Pending>
  using Stack = absl::InlinedVector<Pending, limits::kMaxKdDepth + 1>;  // one pending child for each level
};

template <class V, class T>
requires Bounded<V, T>
template <RayVisitor<V, T> Visitor>
void KdTree<V, T>::visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const {
  struct Pending {
    uint32_t node;
    S near, far;  // interval of the ray in the node's part of space
  };
  if (size() == 0) return;
  if (planted(PlantedBug::kKdRayFromInside) && !locus::contains(bounds(), slabs.origin())) return;
  // A value with its own interval before the origin may lie in parts after the origin, so the limit of parts is not
  // negative.
  const auto beyond = [&](S near) {
    if (planted(PlantedBug::kKdRayToBorder)) return false;
    const S limit = std::max(visitor.limit(), S{0});
    return planted(PlantedBug::kStrictTie) ? near >= limit : near > limit;
  };
  const auto wanted = [&](const Aabb<S>& own) {
    const Interval<S> interval = slabs.interval(own);
    return interval.near <= interval.far && interval.far >= 0 && interval.near <= visitor.limit();
  };
  const S magnitude = planted(PlantedBug::kKdRayUnpadded) ? S{0} : locus::magnitude(bounds());
  const Interval<S> whole = slabs.interval(bounds(), magnitude);
  PassedValues passed;
  Stack<Pending> pending;
  const auto push = [&](uint32_t node, S near, S far) {
    if (near <= far && far >= 0 && !beyond(near)) pending.push_back({node, near, far});
  };
  push(0, whole.near, whole.far);
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    if (beyond(now.near)) continue;  // the limit may have decreased since the push
    ++work.nodes;
    const Node& node = nodes()[now.node];
    if (!pass_values(node, wanted, visitor, passed, work)) return;
    if (node.is_leaf()) continue;
    const Interval<S> below = slabs.interval(half_space(node, KdSide::kBelow), magnitude);
    const Interval<S> above = slabs.interval(half_space(node, KdSide::kAbove), magnitude);
    const auto push_below = [&] { push(node.below, std::max(now.near, below.near), std::min(now.far, below.far)); };
    const auto push_above = [&] { push(node.above(), std::max(now.near, above.near), std::min(now.far, above.far)); };
    if (slabs.direction()[node.axis] < 0) {
      push_below();
      push_above();
    } else {
      push_above();
      push_below();
    }
    LOCUS_DCHECK_LE(pending.size(), size_t{limits::kMaxKdDepth} + 1);
  }
}

template <class V, class T>
requires Bounded<V, T>
template <RegionVisitor<V, T> Visitor>
void KdTree<V, T>::visit_region(Visitor& visitor, Work& work) const {
  const Aabb<S> box = visitor.bounds();
  if (!overlaps(box, bounds())) return;
  const auto wanted = [&](const Aabb<S>& own) { return visitor.overlaps(own); };
  PassedValues passed;
  Stack<uint32_t> pending = {0};
  while (!pending.empty()) {
    const Node& node = nodes()[pending.back()];
    pending.pop_back();
    ++work.nodes;
    if (!pass_values(node, wanted, visitor, passed, work)) return;
    if (node.is_leaf()) continue;
    const S low = box.min[node.axis];
    if (box.max[node.axis] >= node.plane) pending.push_back(node.above());
    if (planted(PlantedBug::kKdLowerStrict) ? low < node.plane : low <= node.plane) pending.push_back(node.below);
  }
}

template <class V, class T>
requires Bounded<V, T>
template <PointVisitor<V, T> Visitor>
void KdTree<V, T>::visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
  struct Pending {
    uint32_t node;
    Vec3d gap;  // distance from the point to the node's part of space on each axis; 0 within
  };
  if (size() == 0) return;
  const auto beyond = [&](double distance) {
    return planted(PlantedBug::kKdNearestStrict) ? distance >= visitor.limit() : distance > visitor.limit();
  };
  const auto wanted = [&](const Aabb<S>& own) { return squared_distance(point, to_double(own)) <= visitor.limit(); };
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
    const double offset = point[node.axis] - double{node.plane};
    Vec3d far_gap = now.gap;
    far_gap[node.axis] = std::max(far_gap[node.axis], std::abs(offset));
    pending.push_back({offset > 0 ? node.below : node.above(), far_gap});
    pending.push_back({offset > 0 ? node.above() : node.below, now.gap});
    LOCUS_DCHECK_LE(pending.size(), size_t{limits::kMaxKdDepth} + 1);
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_KD_TREE_KD_TREE_H_
