// Bounding volume hierarchy for values that seldom move: a tree of boxes with up to eight children per node and up to
// eight values per leaf, built by the surface area heuristic. Stores the instances of a scene; TriangleBvh stores the
// triangles of a mesh.
//
// The lower part of the tree is divided into blocks of up to kBvhBlockValues values (bvh_blocks.h). change() makes a
// tree in which some values are replaced, removed or added: it shares all blocks without these values with the old
// tree, and copies the nodes above the blocks. A tree degrades when its values move, which is measured by the sum of
// the areas of its boxes: a block is built again when its sum has grown by half, and the whole tree when the sum of the
// tree has grown by half. The whole tree is also built again when its blocks have too few values.
//
// Threads: immutable after build() and change(); every member may run concurrently. Invariants: a node's box contains
// the bounds of every value below it. The slab test is monotone: a ray that hits a box also hits every box that
// contains this box. The tree therefore never culls a value that a ListIndex, which tests every value, would report.
// The depth of the nodes above the blocks, and the depth of each block, bound the size of a visit's stack.
// Source: Kay and Kajiya, Ray Tracing Complex Scenes, 1986; Wald, Benthin, Boulos, Getting Rid of Packets, 2008 (wide
// nodes); Lauterbach, Yoon, Tuft, Manocha, RT-DEFORM, 2006 (refit, and a rebuild when the areas have grown).
#ifndef LOCUS_CORE_INDEX_BVH_BVH_H_
#define LOCUS_CORE_INDEX_BVH_BVH_H_

#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/base/status_macros.h"
#include "core/index/bvh/bvh_blocks.h"
#include "core/index/bvh/bvh_build.h"
#include "core/index/spatial_index.h"

namespace locus {

template <class V, class T>
requires Bounded<V, T>
class BvhChanging;

// Values that a tree has and another tree does not have. A position is one that Bvh::at() takes.
template <class V>
struct BvhChange {
  struct Replacement {
    uint32_t position;
    V value;  // has the id of the value at `position`
  };
  std::vector<Replacement> replaced;  // of distinct positions, none of which is removed
  std::vector<uint32_t> removed;      // distinct positions
  std::vector<V> added;

  bool empty() const { return replaced.empty() && removed.empty() && added.empty(); }
};

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class Bvh {
  using S = typename T::Scalar;

 public:
  using Value = V;
  using Traits = T;

  // Makes an empty tree.
  Bvh() = default;

  // Builds a tree of `values`, whose ids must be unique; an empty vector is legal. Returns the errors of
  // build_bvh_layout(); an error caused by one value names the field "values" and the value's index.
  static absl::StatusOr<Bvh> build(std::vector<V> values, const BvhOptions& options = {}) {
    std::vector<Aabb<S>> boxes;
    boxes.reserve(values.size());
    for (const V& value : values) boxes.push_back(Traits::bounds(value));
    ASSIGN_OR_RETURN(BvhLayout<S> layout, build_bvh_layout<S>(boxes, options));
    return Bvh(BvhCutter<V, T>(layout, values).run());
  }

  struct Changed;
  // Returns a tree without the removed values, with the replaced and with the added values. Preconditions: those of
  // BvhChange; the bounds of all values are finite and not empty. Returns the errors of build(). Defined in
  // bvh_change.h. Cost: that of copying the blocks that change, and the nodes above all blocks, unless the whole tree
  // is built again.
  absl::StatusOr<Changed> change(BvhChange<V> change) const;

  size_t size() const { return size_; }

  // Range of all values in storage order. This order is depth-first after build(). A forward range.
  class Values {
   public:
    class Iterator {
     public:
      using iterator_category = std::forward_iterator_tag;
      using value_type = V;
      using difference_type = std::ptrdiff_t;
      using pointer = const V*;
      using reference = const V&;

      Iterator() = default;
      const V& operator*() const { return block_->values[slot_]; }
      const V* operator->() const { return &block_->values[slot_]; }
      Iterator& operator++() {
        if (++slot_ == block_->block->values.size()) {
          ++block_;
          slot_ = 0;
        }
        return *this;
      }
      Iterator operator++(int) {
        const Iterator before = *this;
        ++*this;
        return before;
      }
      bool operator==(const Iterator&) const = default;

     private:
      friend class Values;
      explicit Iterator(const BvhBlockSlot<V, T>* block) : block_(block) {}
      const BvhBlockSlot<V, T>* block_ = nullptr;
      size_t slot_ = 0;
    };
    using const_iterator = Iterator;
    using value_type = V;

    explicit Values(const Bvh& tree) : tree_(&tree) {}
    Iterator begin() const { return Iterator(tree_->blocks_.data()); }
    Iterator end() const { return Iterator(tree_->blocks_.data() + tree_->blocks_.size()); }
    size_t size() const { return tree_->size(); }
    bool empty() const { return size() == 0; }

   private:
    const Bvh* tree_;
  };
  Values values() const { return Values(*this); }

  // Returns the number of blocks, and the values of one of them. The value at `slot` of block `block` has the position
  // block * kBvhBlockValues + slot.
  uint32_t block_count() const { return static_cast<uint32_t>(blocks_.size()); }
  absl::Span<const V> block(uint32_t block) const { return blocks_[block].block->values; }
  const V& at(uint32_t position) const {
    LOCUS_DCHECK_LT(position % kBvhBlockValues, block(position / kBvhBlockValues).size());
    return blocks_[position / kBvhBlockValues].values[position % kBvhBlockValues];
  }

  // Returns the box around all values; an empty box for an empty tree.
  const Aabb<S>& bounds() const { return bounds_; }
  // Returns the number of all nodes, including those in blocks. O(blocks).
  size_t node_count() const;
  // Returns the number of nodes on the longest way from the root to a value. O(nodes).
  uint32_t depth() const;
  // Returns the size in bytes of the tree. O(blocks).
  size_t bytes() const { return unshared_bytes(Bvh()); }
  // Returns the size in bytes of the parts that this tree does not share with `other`. O(blocks).
  size_t unshared_bytes(const Bvh& other) const;
  // Calls fn(value) for each value in a block that `other` does not have at the same index. O(blocks + calls).
  template <class Fn>
  void for_each_apart_from(const Bvh& other, const Fn& fn) const;

  // Returns the expected number of nodes and leaves opened by a random ray that hits bounds(). The root counts as 1.
  // Each node or leaf below the root counts as its surface area divided by the surface area of bounds(). Returns 0 for
  // an empty tree. O(nodes).
  double sah_cost() const;

  // Passes candidates to `visitor` roughly in the order in which the ray enters their leaves: the children of each node
  // are visited in order of entry. Allocates memory only if more than 16 nodes and leaves are pending.
  template <RayVisitor<V, T> Visitor>
  void visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const;

  // Passes to `visitor` the values whose own bounds visitor.overlaps() accepts, in the order of the nodes, which is
  // that of values() until the first change(). Allocates no memory.
  template <RegionVisitor<V, T> Visitor>
  void visit_region(Visitor& visitor, Work& work) const;

  // Passes to `visitor` the values whose own bounds have a squared distance of at most visitor.limit() from `point`,
  // roughly nearest first. Allocates memory only if more than 16 nodes and leaves are pending.
  template <PointVisitor<V, T> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const;

  // Resumable traversal of a tree along a ray: each call of next() returns one candidate, so that the caller can
  // process the candidates of many rays together. Borrows the tree. One thread at a time.
  class RayWalk {
   public:
    RayWalk(const Bvh& tree, const SlabRay<S>& slabs)
        : tree_(&tree),
          slabs_(slabs),
          pending_(tree.blocks_.empty() ? 0 : 1, Pending{nullptr, tree.root_, -std::numeric_limits<S>::infinity()}) {}

    const SlabRay<S>& slabs() const { return slabs_; }
    // Returns the next value in the order of visit_ray(), or null after the last value. `limit` is the largest near
    // value of interest (see RayVisitor::limit()); it may decrease from call to call, but not increase.
    const V* next(S limit, Work& work);

   private:
    struct Pending {
      const BvhBlockSlot<V, T>* block;  // block of the child; null for a child of a node above the blocks
      BvhChild child;
      S near;
    };

    // Pushes the children of `node`, a node of `block`, that the ray may hit at t <= `limit`. The nearest child is
    // pushed last, so that it is popped first.
    void push_hit(const BvhBlockSlot<V, T>* block, const BvhNode<S>& node, S limit);

    const Bvh* tree_;
    SlabRay<S> slabs_;
    const V* value_ = nullptr;  // next value of the current leaf, up to end_
    const V* end_ = nullptr;
    absl::InlinedVector<Pending, 16> pending_;  // seldom more than 16 elements, at most kStackSize
  };

 private:
  friend class BvhChanging<V, T>;

  // Maximum number of pending children in the nodes above the blocks, and in one block: on each level one child is
  // being visited and kBvhWidth - 1 are pending; on the last level all kBvhWidth are pending. The nodes above the
  // blocks have one level more than a build makes.
  static constexpr size_t kStackSize = size_t{limits::kMaxBvhDepth + 1} * (kBvhWidth - 1) + 1;

  explicit Bvh(BvhCut<V, T> cut) : nodes_(std::move(cut.nodes)), blocks_(std::move(cut.blocks)) {
    measure();
    built_area_ = area_;
    if (!blocks_.empty()) built_fill_ = static_cast<double>(size_) / static_cast<double>(blocks_.size());
    LOCUS_DCHECK_CALL(check_invariants());
  }

  // Computes the boxes and areas of the nodes above the blocks, and all members that depend on the nodes and blocks.
  // O(blocks).
  void measure();
  // Verifies, in debug builds, the bounds and ranges of all leaves, the order of nodes, and the number of values. O(n).
  void check_invariants() const;
  void check_block(const BvhBlock<V, T>& block) const;

  // Returns where a visit enters the block that `child`, a child of a node above the blocks, stands for.
  static BvhChild entry(BvhChild child) { return {0, child.count == kBvhBlockRoot ? 0 : child.count}; }
  template <RegionVisitor<V, T> Visitor>
  static bool visit_block(const BvhBlockSlot<V, T>& block, BvhChild entry, Visitor& visitor, Work& work);

  // Returns whether a box that the ray enters at `near` can be skipped. A box with `near` equal to `limit` cannot be
  // skipped: it may hold a hit at the same t with a lower id, which is preferred.
  static bool beyond(S near, S limit) { return planted(PlantedBug::kStrictTie) ? near >= limit : near > limit; }

  Interval<S> node_interval(const SlabRay<S>& slabs, const Aabb<S>& box) const {
    Interval<S> result = slabs.interval(box, magnitude_);
    if (planted(PlantedBug::kUnpaddedNear))
      result.near = SlabRay<S>(Ray<S>{slabs.origin(), slabs.direction()}, 0).interval(box).near;
    return result;
  }

  std::vector<BvhNode<S>> nodes_;           // nodes above the blocks; children follow their parents
  std::vector<BvhBlockSlot<V, T>> blocks_;  // in any order
  BvhChild root_ = {0, 0};
  size_t size_ = 0;
  Aabb<S> bounds_;
  S magnitude_ = 0;                      // largest |coordinate| of the bounds; the slab tests of all nodes use it
  double area_ = 0;                      // half areas of the boxes of all nodes
  double built_area_ = 0;                // least area_ since the whole tree was built
  double built_fill_ = kBvhBlockValues;  // values for each block when the whole tree was built
};

template <class V, class T>
requires Bounded<V, T>
struct Bvh<V, T>::Changed {
  Bvh tree;
  // Blocks of `tree` that have values at other positions than in the old tree, ascending. Positions of other blocks are
  // the same in both trees.
  std::vector<uint32_t> blocks;
};

template <class V, class T>
requires Bounded<V, T>
void Bvh<V, T>::measure() {
  area_ = 0;
  size_ = 0;
  for (const BvhBlockSlot<V, T>& slot : blocks_) {
    area_ += slot.block->area;
    size_ += slot.block->values.size();
  }
  for (size_t index = nodes_.size(); index-- > 0;) {
    BvhNode<S>& node = nodes_[index];
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      BvhChild& child = node.children[slot];
      if (child.is_leaf()) {
        node.bounds[slot] = blocks_[child.first].block->bounds;
        child = child_of(child.first, blocks_[child.first]);
      } else {
        node.bounds[slot] = bounds_of_node(nodes_[child.first]);
        area_ += double{half_area(node.bounds[slot])};
      }
    }
  }
  root_ = nodes_.empty() && !blocks_.empty() ? child_of(0, blocks_[0]) : BvhChild{0, 0};
  bounds_ = blocks_.empty() ? Aabb<S>() : nodes_.empty() ? blocks_[0].block->bounds : bounds_of_node(nodes_[0]);
  magnitude_ = blocks_.empty() ? S{0} : magnitude(bounds_);
}

template <class V, class T>
requires Bounded<V, T> size_t Bvh<V, T>::node_count()
const {
  size_t count = nodes_.size();
  for (const BvhBlockSlot<V, T>& slot : blocks_) count += slot.block->nodes.size();
  return count;
}

template <class V, class T>
requires Bounded<V, T> uint32_t Bvh<V, T>::depth()
const {
  // Children follow their parents, so one pass from the end has the depths of the children of each node.
  const auto depth_of = [](const std::vector<BvhNode<S>>& nodes, const auto& depth_of_leaf) {
    std::vector<uint32_t> depths(nodes.size());
    for (size_t index = nodes.size(); index-- > 0;) {
      const BvhNode<S>& node = nodes[index];
      uint32_t deepest = 0;
      for (uint32_t slot = 0; slot < node.child_count; ++slot) {
        const BvhChild& child = node.children[slot];
        deepest = std::max(deepest, child.is_leaf() ? depth_of_leaf(child) : depths[child.first]);
      }
      depths[index] = deepest + 1;
    }
    return depths.empty() ? 0 : depths.front();
  };
  const auto of_block = [&](uint32_t block) {
    return depth_of(blocks_[block].block->nodes, [](const BvhChild&) { return 0u; });
  };
  if (nodes_.empty()) return blocks_.empty() ? 0 : of_block(0);
  return depth_of(nodes_, [&](const BvhChild& child) { return of_block(child.first); });
}

template <class V, class T>
requires Bounded<V, T> size_t Bvh<V, T>::unshared_bytes(const Bvh& other)
const {
  if (blocks_.empty()) return 0;
  size_t bytes = nodes_.size() * sizeof(BvhNode<S>) + blocks_.size() * sizeof(BvhBlockSlot<V, T>);
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const BvhBlock<V, T>& block = *blocks_[i].block;
    if (i < other.blocks_.size() && other.blocks_[i].block.get() == &block) continue;
    bytes += sizeof(block) + block.nodes.size() * sizeof(BvhNode<S>) + block.values.size() * sizeof(V);
  }
  return bytes;
}

template <class V, class T>
requires Bounded<V, T>
template <class Fn>
void Bvh<V, T>::for_each_apart_from(const Bvh& other, const Fn& fn) const {
  for (size_t i = 0; i < blocks_.size(); ++i) {
    if (i < other.blocks_.size() && other.blocks_[i].block == blocks_[i].block) continue;
    for (const V& value : blocks_[i].block->values) fn(value);
  }
}

template <class V, class T>
requires Bounded<V, T>
double Bvh<V, T>::sah_cost() const {
  if (blocks_.empty()) return 0;
  const double root_area = double{half_area(bounds_)};
  double sum = 1;
  const auto add = [&](absl::Span<const BvhNode<S>> nodes) {
    for (const BvhNode<S>& node : nodes)
      for (uint32_t slot = 0; slot < node.child_count; ++slot)
        sum += root_area > 0 ? double{half_area(node.bounds[slot])} / root_area : 1;
  };
  add(nodes_);
  for (const BvhBlockSlot<V, T>& slot : blocks_) add(slot.block->nodes);
  return sum;
}

template <class V, class T>
requires Bounded<V, T>
void Bvh<V, T>::check_invariants() const {
  size_t values = 0;
  size_t linked = nodes_.empty() ? blocks_.size() : 0;
  LOCUS_DCHECK(!nodes_.empty() || blocks_.size() <= 1);
  for (const BvhBlockSlot<V, T>& slot : blocks_) {
    values += slot.block->values.size();
    LOCUS_DCHECK_CALL(check_block(*slot.block));
  }
  LOCUS_DCHECK_EQ(values, size_);
  for (uint32_t index = 0; index < nodes_.size(); ++index) {
    const BvhNode<S>& node = nodes_[index];
    LOCUS_DCHECK(0 < node.child_count && node.child_count <= kBvhWidth);
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      const BvhChild child = node.children[slot];
      LOCUS_DCHECK(contains(bounds_, node.bounds[slot]));
      if (!child.is_leaf()) {
        LOCUS_DCHECK(index < child.first && child.first < nodes_.size());
        LOCUS_DCHECK(contains(node.bounds[slot], bounds_of_node(nodes_[child.first])));
        continue;
      }
      LOCUS_DCHECK_LT(child.first, blocks_.size());
      LOCUS_DCHECK_EQ(child.count, child_of(child.first, blocks_[child.first]).count);
      LOCUS_DCHECK(contains(node.bounds[slot], blocks_[child.first].block->bounds));
      ++linked;
    }
  }
  LOCUS_DCHECK_EQ(linked, blocks_.size());
}

template <class V, class T>
requires Bounded<V, T>
void Bvh<V, T>::check_block(const BvhBlock<V, T>& block) const {
  LOCUS_DCHECK(!block.values.empty() && block.values.size() <= kBvhBlockValues);
  size_t leaf_values = 0;
  for (uint32_t index = 0; index < block.nodes.size(); ++index) {
    const BvhNode<S>& node = block.nodes[index];
    LOCUS_DCHECK(0 < node.child_count && node.child_count <= kBvhWidth);
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      const BvhChild child = node.children[slot];
      LOCUS_DCHECK(contains(block.bounds, node.bounds[slot]));
      if (!child.is_leaf()) {
        LOCUS_DCHECK(index < child.first && child.first < block.nodes.size());
        LOCUS_DCHECK(contains(node.bounds[slot], bounds_of_node(block.nodes[child.first])));
        continue;
      }
      LOCUS_DCHECK_LE(size_t{child.first} + child.count, block.values.size());
      LOCUS_DCHECK(
          contains(node.bounds[slot],
                   bounds_of_values<V, T>(absl::MakeConstSpan(block.values).subspan(child.first, child.count))));
      leaf_values += child.count;
    }
  }
  LOCUS_DCHECK(block.nodes.empty() || leaf_values == block.values.size());
}

template <class V, class T>
requires Bounded<V, T>
const V* Bvh<V, T>::RayWalk::next(S limit, Work& work) {
  while (value_ == end_) {
    if (pending_.empty()) return nullptr;
    Pending now = pending_.back();
    pending_.pop_back();
    // The limit may have decreased since the push.
    if (beyond(now.near, limit)) continue;
    if (now.block == nullptr && now.child.is_leaf()) {
      now.block = &tree_->blocks_[now.child.first];
      now.child = entry(now.child);
    }
    if (now.child.is_leaf()) {
      value_ = now.block->values + now.child.first;
      end_ = value_ + now.child.count;
    } else {
      ++work.nodes;
      push_hit(now.block, (now.block == nullptr ? tree_->nodes_.data() : now.block->nodes)[now.child.first], limit);
    }
  }
  ++work.tests;
  return value_++;
}

template <class V, class T>
requires Bounded<V, T>
void Bvh<V, T>::RayWalk::push_hit(const BvhBlockSlot<V, T>* block, const BvhNode<S>& node, S limit) {
  const size_t base = pending_.size();
  for (uint32_t slot = 0; slot < node.child_count; ++slot) {
    const Interval<S> interval = tree_->node_interval(slabs_, node.bounds[slot]);
    if (interval.near > interval.far || interval.far < 0 || beyond(interval.near, limit)) continue;
    size_t position = pending_.size();
    pending_.emplace_back();
    for (; position > base && pending_[position - 1].near < interval.near; --position)
      pending_[position] = pending_[position - 1];
    pending_[position] = {block, node.children[slot], interval.near};
  }
  LOCUS_DCHECK_LE(pending_.size(), 2 * kStackSize);
}

template <class V, class T>
requires Bounded<V, T>
template <RayVisitor<V, T> Visitor>
void Bvh<V, T>::visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const {
  RayWalk walk(*this, slabs);
  while (const V* const value = walk.next(visitor.limit(), work))
    if (!visitor.visit(*value)) return;
}

template <class V, class T>
requires Bounded<V, T>
template <RegionVisitor<V, T> Visitor>
void Bvh<V, T>::visit_region(Visitor& visitor, Work& work) const {
  if (blocks_.empty()) return;
  BvhChild stack[kStackSize];
  BvhChild* top = stack;
  *top++ = root_;
  while (top != stack) {
    const BvhChild now = *--top;
    if (now.is_leaf()) {
      if (!visit_block(blocks_[now.first], entry(now), visitor, work)) return;
      continue;
    }
    ++work.nodes;
    const BvhNode<S>& node = nodes_[now.first];
    for (uint32_t slot = node.child_count; slot-- > 0;) {
      if (visitor.overlaps(node.bounds[slot])) *top++ = node.children[slot];
    }
    LOCUS_DCHECK_LE(static_cast<size_t>(top - stack), kStackSize);
  }
}

template <class V, class T>
requires Bounded<V, T>
template <RegionVisitor<V, T> Visitor>
bool Bvh<V, T>::visit_block(const BvhBlockSlot<V, T>& block, BvhChild entry, Visitor& visitor, Work& work) {
  BvhChild stack[kStackSize];
  BvhChild* top = stack;
  *top++ = entry;
  while (top != stack) {
    const BvhChild now = *--top;
    if (!now.is_leaf()) {
      ++work.nodes;
      const BvhNode<S>& node = block.nodes[now.first];
      for (uint32_t slot = node.child_count; slot-- > 0;) {
        if (visitor.overlaps(node.bounds[slot])) *top++ = node.children[slot];
      }
      LOCUS_DCHECK_LE(static_cast<size_t>(top - stack), kStackSize);
      continue;
    }
    for (const V& value : absl::MakeConstSpan(block.values + now.first, now.count)) {
      if (!visitor.overlaps(Traits::bounds(value))) continue;
      ++work.tests;
      if (!visitor.visit(value)) return false;
    }
  }
  return true;
}

template <class V, class T>
requires Bounded<V, T>
template <PointVisitor<V, T> Visitor>
void Bvh<V, T>::visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
  struct Pending {
    const BvhBlockSlot<V, T>* block;  // as in RayWalk
    BvhChild child;
    double distance;
  };
  absl::InlinedVector<Pending, 16> pending(blocks_.empty() ? 0 : 1, Pending{nullptr, root_, 0});
  while (!pending.empty()) {
    Pending now = pending.back();
    pending.pop_back();
    // The limit may have decreased since the push.
    if (now.distance > visitor.limit()) continue;
    if (now.block == nullptr && now.child.is_leaf()) {
      now.block = &blocks_[now.child.first];
      now.child = entry(now.child);
    }
    if (now.child.is_leaf()) {
      for (const V& value : absl::MakeConstSpan(now.block->values + now.child.first, now.child.count)) {
        if (squared_distance(point, to_double(Traits::bounds(value))) > visitor.limit()) continue;
        ++work.tests;
        if (!visitor.visit(value)) return;
      }
      continue;
    }
    ++work.nodes;
    const BvhNode<S>& node = (now.block == nullptr ? nodes_.data() : now.block->nodes)[now.child.first];
    const size_t base = pending.size();
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      const double distance = squared_distance(point, to_double(node.bounds[slot]));
      if (distance > visitor.limit()) continue;
      size_t position = pending.size();
      pending.emplace_back();
      for (; position > base && pending[position - 1].distance < distance; --position)
        pending[position] = pending[position - 1];
      pending[position] = {now.block, node.children[slot], distance};
    }
    LOCUS_DCHECK_LE(pending.size(), 2 * kStackSize);
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_H_
