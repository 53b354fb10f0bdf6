// The bounding volume hierarchy for what does not move: a tree of boxes, eight children a node, up to eight values a
// leaf, built once by the surface area heuristic. Serves the triangles of a mesh and the instances of a scene.
//
// Threads: immutable after build(); every member may run concurrently.
// Invariants: a node's box contains the bounds of every value below it, so that the slab test, which is monotone, never
// culls what a list would report; depth is at most limits::kMaxBvhDepth, which sizes the fixed stack of a visit; values
// lie in depth-first order.
// Source: Kay and Kajiya, Ray Tracing Complex Scenes, 1986; Wald, Benthin, Boulos, Getting Rid of Packets, 2008 (wide
// nodes).
#ifndef LOCUS_CORE_INDEX_BVH_BVH_H_
#define LOCUS_CORE_INDEX_BVH_BVH_H_

#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
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

  // An empty tree.
  Bvh() = default;

  // Ids must be unique. No values is legal. Errors: as build_bvh_layout(); `values` of an error is the value's index.
  static absl::StatusOr<Bvh> build(std::vector<V> values, const BvhOptions& options = {}) {
    std::vector<Aabb<S>> boxes;
    boxes.reserve(values.size());
    for (const V& value : values) boxes.push_back(Traits::bounds(value));
    ASSIGN_OR_RETURN(BvhLayout<S> layout, build_bvh_layout<S>(boxes, options));
    return Bvh(std::move(layout), std::move(values));
  }

  size_t size() const { return values_.size(); }
  // In depth-first order: the storage order, fixed by input and options.
  absl::Span<const V> values() const { return values_; }
  // Of all values; empty for none.
  const Aabb<S>& bounds() const { return bounds_; }
  uint32_t depth() const { return depth_; }
  size_t node_count() const { return nodes_.size(); }
  size_t bytes() const { return nodes_.size() * sizeof(BvhNode<S>) + values_.size() * sizeof(V); }

  // What an average ray that meets the tree's bounds costs: nodes and leaves it opens, by the ratio of surface areas. 0
  // for an empty tree. O(nodes).
  double sah_cost() const;

  // Near to far by the boxes of nodes. Allocates only where more than sixteen nodes wait.
  template <RayVisitor<V> Visitor>
  void visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const;

  // In storage order; hands over only values whose own bounds overlap. Allocates nothing.
  template <RegionVisitor<V> Visitor>
  void visit_region(Visitor& visitor, Work& work) const;

  // Nearest boxes first; hands over only values whose own bounds are within the limit. Allocates only where more than
  // sixteen nodes wait.
  template <PointVisitor<V> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const;

  // A ray's way from value to value, for those who cannot answer a visitor at once. Borrows the tree. One thread at a
  // time.
  class RayWalk {
   public:
    RayWalk(const Bvh& tree, const SlabRay<S>& slabs)
        : tree_(&tree),
          slabs_(slabs),
          pending_(tree.nodes_.empty() ? 0 : 1, Pending{{0, 0}, -std::numeric_limits<S>::infinity()}) {}

    const SlabRay<S>& slabs() const { return slabs_; }
    // The next value as visit_ray() hands them over, null behind the last. `limit` may fall from call to call.
    const V* next(S limit, Work& work);

   private:
    struct Pending {
      BvhChild child;
      S near;
    };

    // Nearest last.
    void push_hit(const BvhNode<S>& node, S limit);

    const Bvh* tree_;
    SlabRay<S> slabs_;
    const V* value_ = nullptr;  // the next of the leaf's values, up to end_
    const V* end_ = nullptr;
    absl::InlinedVector<Pending, 16> pending_;  // seldom more, at most kStackSize
  };

 private:
  // Each level leaves at most all but one of its children waiting.
  static constexpr size_t kStackSize = size_t{limits::kMaxBvhDepth} * (kBvhWidth - 1) + 1;

  Bvh(BvhLayout<S> layout, std::vector<V> values)
      : nodes_(std::move(layout.nodes)),
        bounds_(layout.bounds),
        magnitude_(values.empty() ? S{0} : magnitude(layout.bounds)),
        depth_(layout.depth) {
    values_.reserve(values.size());
    for (const uint32_t index : layout.order) values_.push_back(std::move(values[index]));
  }

  // Boxes that start exactly at the limit are wanted: a lower id may wait there.
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
  S magnitude_ = 0;  // one for all boxes of the tree: at least that of each
  uint32_t depth_ = 0;
};

template <Bounded V>
double Bvh<V>::sah_cost() const {
  if (nodes_.empty()) return 0;
  const double whole = double{half_area(bounds_)};
  double sum = 1;
  for (const BvhNode<S>& node : nodes_) {
    for (uint32_t slot = 0; slot < node.child_count; ++slot)
      sum += whole > 0 ? double{half_area(node.bounds[slot])} / whole : 1;
  }
  return sum;
}

template <Bounded V>
const V* Bvh<V>::RayWalk::next(S limit, Work& work) {
  while (value_ == end_) {
    if (pending_.empty()) return nullptr;
    const Pending now = pending_.back();
    pending_.pop_back();
    // The limit may have fallen since the push.
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
    size_t place = pending_.size();
    pending_.emplace_back();
    for (; place > base && pending_[place - 1].near < interval.near; --place) pending_[place] = pending_[place - 1];
    pending_[place] = {node.children[slot], interval.near};
  }
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
  struct Waiting {
    BvhChild child;
    double away;
  };
  absl::InlinedVector<Waiting, 16> waiting(nodes_.empty() ? 0 : 1, Waiting{{0, 0}, 0});
  while (!waiting.empty()) {
    const Waiting now = waiting.back();
    waiting.pop_back();
    // The limit may have fallen since the push.
    if (now.away > visitor.limit()) continue;
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
    const size_t base = waiting.size();
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      const double away = squared_distance(point, to_double(node.bounds[slot]));
      if (away > visitor.limit()) continue;
      size_t place = waiting.size();
      waiting.emplace_back();
      for (; place > base && waiting[place - 1].away < away; --place) waiting[place] = waiting[place - 1];
      waiting[place] = {node.children[slot], away};
    }
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_H_
