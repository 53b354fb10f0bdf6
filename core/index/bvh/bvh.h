// Bounding volume hierarchy for values that do not move: a tree of boxes with up to eight children per node and up to
// eight values per leaf, built once by the surface area heuristic. Stores the instances of a scene; TriangleBvh stores
// the triangles of a mesh.
//
// Threads: immutable after build(); every member may run concurrently. Invariants: a node's box contains the bounds of
// every value below it. The slab test is monotone: a ray that hits a box also hits every box that contains this box.
// The tree therefore never culls a value that a ListIndex, which tests every value, would report. The depth is at most
// limits::kMaxBvhDepth, which bounds the size of a visit's stack. Nodes and values are stored in depth-first order.
// Source: Kay and Kajiya, Ray Tracing Complex Scenes, 1986; Wald, Benthin, Boulos, Getting Rid of Packets, 2008 (wide
// nodes).
#ifndef LOCUS_CORE_INDEX_BVH_BVH_H_
#define LOCUS_CORE_INDEX_BVH_BVH_H_

#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/base/status_macros.h"
#include "core/index/bvh/bvh_build.h"
#include "core/index/spatial_index.h"

namespace locus {

template <Bounded V>
class Bvh {
  using Traits = PrimitiveTraits<V>;
  using S = ScalarOf<V>;

 public:
  using Value = V;

  // Makes an empty tree.
  Bvh() = default;

  // Builds a tree of `values`, whose ids must be unique; an empty vector is legal. Returns the errors of
  // build_bvh_layout(); an error caused by one value names the field "values" and the value's index.
  static absl::StatusOr<Bvh> build(std::vector<V> values, const BvhOptions& options = {}) {
    std::vector<Aabb<S>> boxes;
    boxes.reserve(values.size());
    for (const V& value : values) boxes.push_back(Traits::bounds(value));
    ASSIGN_OR_RETURN(BvhLayout<S> layout, build_bvh_layout<S>(boxes, options));
    return Bvh(std::move(layout), std::move(values));
  }

  size_t size() const { return values_.size(); }
  // Returns all values in storage order. This order is depth-first and depends only on the input and the options of the
  // build.
  absl::Span<const V> values() const { return values_; }
  // Returns the box around all values; an empty box for an empty tree.
  const Aabb<S>& bounds() const { return bounds_; }
  uint32_t depth() const { return depth_; }
  size_t node_count() const { return nodes_.size(); }
  size_t bytes() const { return nodes_.size() * sizeof(BvhNode<S>) + values_.size() * sizeof(V); }

  // Returns the expected number of nodes and leaves opened by a random ray that hits bounds(). The root counts as 1.
  // Each node or leaf below the root counts as its surface area divided by the surface area of bounds(). Returns 0 for
  // an empty tree. O(nodes).
  double sah_cost() const;

  // Passes candidates to `visitor` roughly in the order in which the ray enters their leaves: the children of each node
  // are visited in order of entry. Allocates memory only if more than 16 nodes and leaves are pending.
  template <RayVisitor<V> Visitor>
  void visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const;

  // Passes to `visitor` the values whose own bounds visitor.overlaps() accepts, in storage order. Allocates no memory.
  template <RegionVisitor<V> Visitor>
  void visit_region(Visitor& visitor, Work& work) const;

  // Passes to `visitor` the values whose own bounds have a squared distance of at most visitor.limit() from `point`,
  // roughly nearest first. Allocates memory only if more than 16 nodes and leaves are pending.
  template <PointVisitor<V> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const;

  // Resumable traversal of a tree along a ray: each call of next() returns one candidate, so that the caller can
  // process the candidates of many rays together. Borrows the tree. One thread at a time.
  class RayWalk {
   public:
    RayWalk(const Bvh& tree, const SlabRay<S>& slabs)
        : tree_(&tree),
          slabs_(slabs),
          pending_(tree.nodes_.empty() ? 0 : 1, Pending{{0, 0}, -std::numeric_limits<S>::infinity()}) {}

    const SlabRay<S>& slabs() const { return slabs_; }
    // Returns the next value in the order of visit_ray(), or null after the last value. `limit` is the largest near
    // value of interest (see RayVisitor::limit()); it may decrease from call to call, but not increase.
    const V* next(S limit, Work& work);

   private:
    struct Pending {
      BvhChild child;
      S near;
    };

    // Pushes the children of `node` that the ray may hit at t <= `limit`. The nearest child is pushed last, so that it
    // is popped first.
    void push_hit(const BvhNode<S>& node, S limit);

    const Bvh* tree_;
    SlabRay<S> slabs_;
    const V* value_ = nullptr;  // next value of the current leaf, up to end_
    const V* end_ = nullptr;
    absl::InlinedVector<Pending, 16> pending_;  // seldom more than 16 elements, at most kStackSize
  };

 private:
  // Maximum number of pending children: on each level one child is being visited and kBvhWidth - 1 are pending; on the
  // last level all kBvhWidth are pending.
  static constexpr size_t kStackSize = size_t{limits::kMaxBvhDepth} * (kBvhWidth - 1) + 1;

  Bvh(BvhLayout<S> layout, std::vector<V> values)
      : nodes_(std::move(layout.nodes)),
        bounds_(layout.bounds),
        magnitude_(values.empty() ? S{0} : magnitude(layout.bounds)),
        depth_(layout.depth) {
    values_.reserve(values.size());
    for (const uint32_t index : layout.order) values_.push_back(std::move(values[index]));
    LOCUS_DCHECK_EQ(values_.size(), values.size());
    LOCUS_DCHECK_CALL(check_invariants());
  }

  // Verifies, in debug builds, the bounds and ranges of all leaves, the order of nodes, and the depth. O(n).
  void check_invariants() const;

  // Returns whether a box that the ray enters at `near` can be skipped. A box with `near` equal to `limit` cannot be
  // skipped: it may hold a hit at the same t with a lower id, which is preferred.
  static bool beyond(S near, S limit) { return planted(PlantedBug::kStrictTie) ? near >= limit : near > limit; }

  Interval<S> node_interval(const SlabRay<S>& slabs, const Aabb<S>& box) const {
    Interval<S> result = slabs.interval(box, magnitude_);
    if (planted(PlantedBug::kUnpaddedNear))
      result.near = SlabRay<S>(Ray<S>{slabs.origin(), slabs.direction()}, 0).interval(box).near;
    return result;
  }

  std::vector<BvhNode<S>> nodes_;
  std::vector<V> values_;
  Aabb<S> bounds_;
  S magnitude_ = 0;  // largest |coordinate| of the bounds; the slab tests of all nodes use it
  uint32_t depth_ = 0;
};

template <Bounded V>
double Bvh<V>::sah_cost() const {
  if (nodes_.empty()) return 0;
  const double root_area = double{half_area(bounds_)};
  double sum = 1;
  for (const BvhNode<S>& node : nodes_) {
    for (uint32_t slot = 0; slot < node.child_count; ++slot)
      sum += root_area > 0 ? double{half_area(node.bounds[slot])} / root_area : 1;
  }
  return sum;
}

template <Bounded V>
void Bvh<V>::check_invariants() const {
  LOCUS_DCHECK_LE(depth_, limits::kMaxBvhDepth);
  size_t leaf_values = 0;
  for (uint32_t index = 0; index < nodes_.size(); ++index) {
    const BvhNode<S>& node = nodes_[index];
    LOCUS_DCHECK_LE(node.child_count, kBvhWidth);
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      const BvhChild child = node.children[slot];
      LOCUS_DCHECK(contains(bounds_, node.bounds[slot]));
      if (!child.is_leaf()) {
        LOCUS_DCHECK(index < child.first && child.first < nodes_.size());
        continue;
      }
      LOCUS_DCHECK_LE(size_t{child.first} + child.count, values_.size());
      for (const V& value : values().subspan(child.first, child.count))
        LOCUS_DCHECK(contains(node.bounds[slot], Traits::bounds(value)));
      leaf_values += child.count;
    }
  }
  LOCUS_DCHECK_EQ(leaf_values, values_.size());
}

template <Bounded V>
const V* Bvh<V>::RayWalk::next(S limit, Work& work) {
  while (value_ == end_) {
    if (pending_.empty()) return nullptr;
    const Pending now = pending_.back();
    pending_.pop_back();
    // The limit may have decreased since the push.
    if (beyond(now.near, limit)) continue;
    if (now.child.is_leaf()) {
      value_ = tree_->values_.data() + now.child.first;
      end_ = value_ + now.child.count;
    } else {
      ++work.nodes;
      push_hit(tree_->nodes_[now.child.first], limit);
    }
  }
  ++work.tests;
  return value_++;
}

template <Bounded V>
void Bvh<V>::RayWalk::push_hit(const BvhNode<S>& node, S limit) {
  const size_t base = pending_.size();
  for (uint32_t slot = 0; slot < node.child_count; ++slot) {
    const Interval<S> interval = tree_->node_interval(slabs_, node.bounds[slot]);
    if (interval.near > interval.far || interval.far < 0 || beyond(interval.near, limit)) continue;
    size_t position = pending_.size();
    pending_.emplace_back();
    for (; position > base && pending_[position - 1].near < interval.near; --position)
      pending_[position] = pending_[position - 1];
    pending_[position] = {node.children[slot], interval.near};
  }
  LOCUS_DCHECK_LE(pending_.size(), kStackSize);
}

template <Bounded V>
template <RayVisitor<V> Visitor>
void Bvh<V>::visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const {
  RayWalk walk(*this, slabs);
  while (const V* const value = walk.next(visitor.limit(), work))
    if (!visitor.visit(*value)) return;
}

template <Bounded V>
template <RegionVisitor<V> Visitor>
void Bvh<V>::visit_region(Visitor& visitor, Work& work) const {
  if (nodes_.empty()) return;
  BvhChild stack[kStackSize];
  BvhChild* top = stack;
  *top++ = {0, 0};
  while (top != stack) {
    const BvhChild now = *--top;
    if (!now.is_leaf()) {
      ++work.nodes;
      const BvhNode<S>& node = nodes_[now.first];
      for (uint32_t slot = node.child_count; slot-- > 0;) {
        if (visitor.overlaps(node.bounds[slot])) *top++ = node.children[slot];
      }
      LOCUS_DCHECK_LE(static_cast<size_t>(top - stack), kStackSize);
      continue;
    }
    for (const V& value : values().subspan(now.first, now.count)) {
      if (!visitor.overlaps(Traits::bounds(value))) continue;
      ++work.tests;
      if (!visitor.visit(value)) return;
    }
  }
}

template <Bounded V>
template <PointVisitor<V> Visitor>
void Bvh<V>::visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
  struct Pending {
    BvhChild child;
    double distance;
  };
  absl::InlinedVector<Pending, 16> pending(nodes_.empty() ? 0 : 1, Pending{{0, 0}, 0});
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    // The limit may have decreased since the push.
    if (now.distance > visitor.limit()) continue;
    if (now.child.is_leaf()) {
      for (const V& value : values().subspan(now.child.first, now.child.count)) {
        if (squared_distance(point, to_double(Traits::bounds(value))) > visitor.limit()) continue;
        ++work.tests;
        if (!visitor.visit(value)) return;
      }
      continue;
    }
    ++work.nodes;
    const BvhNode<S>& node = nodes_[now.child.first];
    const size_t base = pending.size();
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      const double distance = squared_distance(point, to_double(node.bounds[slot]));
      if (distance > visitor.limit()) continue;
      size_t position = pending.size();
      pending.emplace_back();
      for (; position > base && pending[position - 1].distance < distance; --position)
        pending[position] = pending[position - 1];
      pending[position] = {node.children[slot], distance};
    }
    LOCUS_DCHECK_LE(pending.size(), kStackSize);
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_H_
