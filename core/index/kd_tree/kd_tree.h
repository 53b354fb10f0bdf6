// kd tree: divides space by planes perpendicular to the axes, for values of any size. The options choose the axis and
// the position of each plane, and where the values lie that a plane cuts.
//
// insert() and remove() never divide or join nodes, so the tree degrades when its values change much: a leaf grows by
// every value that is inserted into its part of space. rebuild() makes the tree that build() would make. A tree that
// was built of no values is one leaf, until rebuild().
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
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/filed_values.h"
#include "core/index/kd_tree/kd_nodes.h"
#include "core/index/spatial_index.h"

namespace locus {

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class KdTree {
  using S = typename T::Scalar;

 public:
  using Value = V;
  using Traits = T;

  // Makes an empty tree.
  explicit KdTree(const KdTreeOptions& options = {}) : nodes_(options) {}

  // Builds a tree of `values`. Preconditions: their ids are unique, and their bounds are finite and not empty.
  // O(n log n) if the planes divide the values evenly.
  static KdTree build(std::vector<V> values, const KdTreeOptions& options = {}) {
    KdTree tree(options);
    tree.values_.reserve(values.size());
    for (V& value : values) tree.values_.add(std::move(value));
    tree.rebuild();
    return tree;
  }

  // Builds the tree again from its values, with the options of the first build.
  void rebuild() {
    values_.close_gaps();
    bounds_ = Aabb<S>();
    std::vector<KdValue<S>> boxes;
    boxes.reserve(size());
    for (uint32_t slot = 0; slot < size(); ++slot) {
      Entry& entry = values_[slot];
      entry.places = 0;
      bounds_ = merge(bounds_, entry.bounds);
      boxes.push_back({entry.bounds, Traits::position(entry.value)});
    }
    nodes_.build(boxes);
    nodes_.for_each_reference([this](uint32_t slot) { ++values_[slot].places; });
    LOCUS_DCHECK_CALL(check_invariants());
  }

  // Inserts a value. Preconditions: those of build(). O(depth + leaves that the value touches).
  void insert(const V& value) {
    const uint32_t slot = values_.add(value);
    Entry& entry = values_[slot];
    if (!planted(PlantedBug::kKdFixedBounds) || bounds_.empty()) bounds_ = merge(bounds_, entry.bounds);
    entry.places = nodes_.insert(slot, entry.bounds);
    LOCUS_DCHECK_CALL(check_value(slot));
  }

  // Removes the value with the id of `value`. Returns false and changes nothing if the tree has no value with this id.
  // Searches the leaves that the value touches: O(depth + values in these leaves).
  bool remove(const V& value) {
    const std::optional<uint32_t> slot = values_.remove(value);
    if (slot) nodes_.remove(*slot, values_[*slot].bounds);
    return slot.has_value();
  }

  bool contains(const V& value) const { return values_.contains(value); }
  size_t size() const { return values_.size(); }
  // Returns the box around all values; after remove() it may be larger, until rebuild().
  const Aabb<S>& bounds() const { return bounds_; }
  // Returns the numbers of nodes and references, and the depth. O(nodes).
  KdShape shape() const { return nodes_.shape(); }

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
  using Entry = typename FiledValues<V, T>::Entry;
  using Node = KdNode<S>;
  template <class Pending>
  using Stack = absl::InlinedVector<Pending, limits::kMaxKdDepth + 1>;  // one pending child for each level

  template <class Wanted, class Visitor>
  bool pass_values(const Node& node, const Wanted& wanted, Visitor& visitor, PassedValues& passed, Work& work) const {
    const PassEach each = planted(PlantedBug::kKdPassedTwice) ? PassEach::kAtEveryNode : PassEach::kOnce;
    return values_.pass(node.values, wanted, visitor, passed, work, each);
  }

  // Checks that exactly the nodes list the value in which it lies. O(depth + values in these nodes).
  void check_value(uint32_t slot) const {
    LOCUS_DCHECK_EQ(nodes_.count(slot, values_[slot].bounds), values_[slot].places);
    LOCUS_DCHECK(locus::contains(bounds_, values_[slot].bounds));
  }
  // Checks all values, and the limits of nodes and references after a build. O(n * depth).
  void check_invariants() const {
    for (const uint32_t slot : values_.slots()) check_value(slot);
    const KdShape shape = this->shape();
    LOCUS_DCHECK(size() == 0 || (shape.nodes < 2 * size() && shape.references < 4 * size()));
    LOCUS_DCHECK_LE(shape.depth, nodes_.options().max_depth);
  }

  FiledValues<V, T> values_;
  Aabb<S> bounds_;
  KdNodes<S> nodes_;
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
  if (planted(PlantedBug::kKdRayFromInside) && !locus::contains(bounds_, slabs.origin())) return;
  // A value with its own interval before the origin may lie in parts after the origin, so the limit of parts is not
  // negative.
  const auto beyond = [&](S near) {
    if (planted(PlantedBug::kKdRayToBorder)) return false;
    const S limit = std::max(visitor.limit(), S{0});
    return planted(PlantedBug::kStrictTie) ? near >= limit : near > limit;
  };
  const auto wanted = [&](const Aabb<S>& bounds) {
    const Interval<S> interval = slabs.interval(bounds);
    return interval.near <= interval.far && interval.far >= 0 && interval.near <= visitor.limit();
  };
  const S magnitude = planted(PlantedBug::kKdRayUnpadded) ? S{0} : locus::magnitude(bounds_);
  const Interval<S> whole = slabs.interval(bounds_, magnitude);
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
    const Node& node = nodes_[now.node];
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
  if (!overlaps(box, bounds_)) return;
  const auto wanted = [&](const Aabb<S>& bounds) { return visitor.overlaps(bounds); };
  PassedValues passed;
  Stack<uint32_t> pending = {0};
  while (!pending.empty()) {
    const Node& node = nodes_[pending.back()];
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
  const auto wanted = [&](const Aabb<S>& bounds) {
    return squared_distance(point, to_double(bounds)) <= visitor.limit();
  };
  PassedValues passed;
  const Aabbd whole = to_double(bounds_);
  Stack<Pending> pending = {{0, max(max(whole.min - point, point - whole.max), Vec3d{})}};
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    if (beyond(squared_length(now.gap))) continue;
    ++work.nodes;
    const Node& node = nodes_[now.node];
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
