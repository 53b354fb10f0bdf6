// Blocks of a Bvh: parts of the tree of up to kBvhBlockValues values each, with the nodes above these values. A tree
// that differs in a few values from another tree shares all other blocks with it. This header has the blocks and the
// functions that make them from the layout of a build, and that adapt the boxes of a block to values that have moved.
// Internal to this folder.
#ifndef LOCUS_CORE_INDEX_BVH_BVH_BLOCKS_H_
#define LOCUS_CORE_INDEX_BVH_BVH_BLOCKS_H_

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/geometry/primitive_traits.h"
#include "core/index/bvh/bvh_node.h"

namespace locus {

// Maximum number of values of a block. Larger blocks make the top of the tree smaller, but a change copies more values.
inline constexpr uint32_t kBvhBlockValues = 64;
// BvhChild::count of a child that is node 0 of a block. A child whose count is another positive number is a block
// without nodes, which has this number of values.
inline constexpr uint32_t kBvhBlockRoot = ~0u;

// Immutable once a tree stores it. Children of `nodes` are nodes of the same block, or ranges of `values`.
template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
struct BvhBlock {
  std::vector<BvhNode<typename T::Scalar>>
      nodes;              // children follow their parents; no nodes: the block is a single leaf
  std::vector<V> values;  // 1 to kBvhBlockValues values in depth-first order
  Aabb<typename T::Scalar> bounds;
  double area = 0;        // half areas of `bounds` and of the boxes of all nodes
  double built_area = 0;  // `area` at the time when the nodes were built
};

// A block and the addresses of its data, so that a visit reads the data without a look at the block itself.
template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
struct BvhBlockSlot {
  const BvhNode<typename T::Scalar>* nodes;
  const V* values;
  std::shared_ptr<const BvhBlock<V, T>> block;  // never null

  explicit BvhBlockSlot(BvhBlock<V, T>&& source)
      : BvhBlockSlot(std::make_shared<const BvhBlock<V, T>>(std::move(source))) {}
  explicit BvhBlockSlot(std::shared_ptr<const BvhBlock<V, T>> owner)
      : nodes(owner->nodes.data()), values(owner->values.data()), block(std::move(owner)) {
    LOCUS_DCHECK(!block->values.empty() && block->values.size() <= kBvhBlockValues);
  }
};

// Returns the child that stands for the block at index `number` in a node above the blocks.
template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T> BvhChild child_of(uint32_t number, const BvhBlockSlot<V, T>& slot) {
  return {number, slot.block->nodes.empty() ? static_cast<uint32_t>(slot.block->values.size()) : kBvhBlockRoot};
}

template <class S>
Aabb<S> bounds_of_node(const BvhNode<S>& node) {
  Aabb<S> bounds;
  for (uint32_t slot = 0; slot < node.child_count; ++slot) bounds = merge(bounds, node.bounds[slot]);
  return bounds;
}

// Returns the child whose box grows least if `bounds` are added to it; of several such children the smallest.
template <class S>
uint32_t child_growing_least(const BvhNode<S>& node, const Aabb<S>& bounds) {
  std::pair<double, double> least;
  uint32_t best = 0;
  for (uint32_t slot = 0; slot < node.child_count; ++slot) {
    const auto area = double{half_area(node.bounds[slot])};
    const std::pair<double, double> cost = {double{half_area(merge(node.bounds[slot], bounds))} - area, area};
    if (slot != 0 && !(cost < least)) continue;
    least = cost;
    best = slot;
  }
  return best;
}

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T> Aabb<typename T::Scalar> bounds_of_values(absl::Span<const V> values) {
  Aabb<typename T::Scalar> bounds;
  for (const V& value : values) bounds = merge(bounds, T::bounds(value));
  return bounds;
}

// Computes all boxes of the block from its values, and BvhBlock::area.
template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
void refit(BvhBlock<V, T>& block) {
  double area = 0;
  for (size_t index = block.nodes.size(); index-- > 0;) {
    auto& node = block.nodes[index];
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      const BvhChild child = node.children[slot];
      node.bounds[slot] =
          child.is_leaf() ? bounds_of_values<V, T>(absl::MakeConstSpan(block.values).subspan(child.first, child.count))
                          : bounds_of_node(block.nodes[child.first]);
      area += double{half_area(node.bounds[slot])};
    }
  }
  block.bounds = block.nodes.empty() ? bounds_of_values<V, T>(block.values) : bounds_of_node(block.nodes[0]);
  block.area = area + double{half_area(block.bounds)};
}

// Removes the values at `slots`, which ascend, from the values and nodes of the block; the boxes do not change. Returns
// false if a node, or the block, would have no values left. The block is then in an unspecified state.
template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
bool remove_values(BvhBlock<V, T>& block, absl::Span<const uint32_t> slots) {
  std::array<uint32_t, kBvhBlockValues + 1> moved_to;
  size_t kept = 0, next = 0;
  for (uint32_t slot = 0; slot < block.values.size(); ++slot) {
    moved_to[slot] = static_cast<uint32_t>(kept);
    if (next < slots.size() && slots[next] == slot) {
      ++next;
      continue;
    }
    if (kept != slot) block.values[kept] = std::move(block.values[slot]);
    ++kept;
  }
  moved_to[block.values.size()] = static_cast<uint32_t>(kept);
  block.values.resize(kept);
  for (auto& node : block.nodes) {
    uint32_t children = 0;
    for (uint32_t slot = 0; slot < node.child_count; ++slot) {
      BvhChild child = node.children[slot];
      if (child.is_leaf()) {
        const uint32_t end = moved_to[child.first + child.count];
        child = {moved_to[child.first], end - moved_to[child.first]};
        if (child.count == 0) continue;
      }
      node.children[children] = child;
      node.bounds[children++] = node.bounds[slot];
    }
    node.child_count = children;
    if (children == 0) return false;
  }
  return kept != 0;
}

// Adds a value to the leaf whose box grows least, or as a further leaf beside it; the boxes do not change. Returns
// false and changes nothing if there is no room.
template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
bool add_value(BvhBlock<V, T>& block, const V& value) {
  if (block.values.size() == kBvhBlockValues) return false;
  if (block.nodes.empty()) {
    if (block.values.size() == kBvhLeafSize) return false;
    block.values.push_back(value);
    return true;
  }
  const auto bounds = T::bounds(value);
  BvhNode<typename T::Scalar>* node = block.nodes.data();
  uint32_t slot = child_growing_least(*node, bounds);
  while (!node->children[slot].is_leaf()) {
    node = &block.nodes[node->children[slot].first];
    slot = child_growing_least(*node, bounds);
  }
  const uint32_t end = node->children[slot].first + node->children[slot].count;
  const bool has_room = node->children[slot].count < kBvhLeafSize;
  if (!has_room && node->child_count == kBvhWidth) return false;
  for (auto& other : block.nodes)
    for (BvhChild& child : absl::MakeSpan(other.children.data(), other.child_count))
      if (child.is_leaf() && child.first >= end) ++child.first;
  block.values.insert(block.values.begin() + end, value);
  if (has_room)
    ++node->children[slot].count;
  else
    node->children[node->child_count++] = {end, 1};
  return true;
}

// A layout that is cut into blocks: the nodes above the blocks, and the blocks in depth-first order. A tree that fits
// into one block has no nodes above it.
template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
struct BvhCut {
  std::vector<BvhNode<typename T::Scalar>> nodes;
  std::vector<BvhBlockSlot<V, T>> blocks;
};

// Cuts a layout into the largest subtrees that are blocks. The nodes keep their boxes and their order, so that the
// visits of the tree open the same nodes in the same order as those of the layout.
template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class BvhCutter {
  using S = typename T::Scalar;

 public:
  // Moves the values from `values`, which are in the order of the input of the build.
  BvhCutter(const BvhLayout<S>& layout, std::vector<V>& values) : layout_(layout), values_(values) {
    ranges_.resize(layout.nodes.size());
    for (size_t index = layout.nodes.size(); index-- > 0;) {
      const BvhNode<S>& node = layout.nodes[index];
      Range& range = ranges_[index];
      range = {first_of(node.children[0]), 0, static_cast<uint32_t>(index) + 1};
      for (uint32_t slot = 0; slot < node.child_count; ++slot) {
        const BvhChild child = node.children[slot];
        range.end = child.is_leaf() ? child.first + child.count : ranges_[child.first].end;
        if (!child.is_leaf()) range.node_end = ranges_[child.first].node_end;
      }
    }
  }

  BvhCut<V, T> run() {
    if (layout_.nodes.empty()) return {};
    if (is_block(0)) {
      cut_.blocks.emplace_back(block_of(0));
      return std::move(cut_);
    }
    struct Pending {
      BvhChild child;         // of the layout
      uint32_t parent, slot;  // in the cut
    };
    std::vector<Pending> pending = {{{0, 0}, 0, 0}};
    while (!pending.empty()) {
      const Pending now = pending.back();
      pending.pop_back();
      if (now.child.is_leaf() || is_block(now.child.first)) {
        cut_.blocks.emplace_back(now.child.is_leaf() ? leaf_of(now.child) : block_of(now.child.first));
        cut_.nodes[now.parent].children[now.slot] =
            child_of(static_cast<uint32_t>(cut_.blocks.size() - 1), cut_.blocks.back());
        continue;
      }
      const auto index = static_cast<uint32_t>(cut_.nodes.size());
      if (index != 0) cut_.nodes[now.parent].children[now.slot] = {index, 0};
      const BvhNode<S>& node = cut_.nodes.emplace_back(layout_.nodes[now.child.first]);
      // Pushes in reverse order, so that the first child is the next one popped: depth-first order.
      for (uint32_t slot = node.child_count; slot-- > 0;) pending.push_back({node.children[slot], index, slot});
    }
    return std::move(cut_);
  }

 private:
  struct Range {
    uint32_t begin, end;  // positions of the values below a node
    uint32_t node_end;    // one more than the index of the last node below the node
  };

  uint32_t first_of(BvhChild child) const { return child.is_leaf() ? child.first : ranges_[child.first].begin; }
  bool is_block(uint32_t node) const { return ranges_[node].end - ranges_[node].begin <= kBvhBlockValues; }

  BvhBlock<V, T> block_with(uint32_t begin, uint32_t end) {
    BvhBlock<V, T> block;
    block.values.reserve(end - begin);
    for (uint32_t position = begin; position < end; ++position)
      block.values.push_back(std::move(values_[layout_.order[position]]));
    return block;
  }
  static BvhBlock<V, T> measured(BvhBlock<V, T> block) {
    refit(block);
    block.built_area = block.area;
    return block;
  }
  BvhBlock<V, T> leaf_of(BvhChild leaf) { return measured(block_with(leaf.first, leaf.first + leaf.count)); }
  BvhBlock<V, T> block_of(uint32_t root) {
    const Range range = ranges_[root];
    BvhBlock<V, T> block = block_with(range.begin, range.end);
    block.nodes.assign(layout_.nodes.begin() + root, layout_.nodes.begin() + range.node_end);
    for (BvhNode<S>& node : block.nodes)
      for (uint32_t slot = 0; slot < node.child_count; ++slot)
        node.children[slot].first -= node.children[slot].is_leaf() ? range.begin : root;
    return measured(std::move(block));
  }

  const BvhLayout<S>& layout_;
  std::vector<V>& values_;
  std::vector<Range> ranges_;  // of each node of the layout
  BvhCut<V, T> cut_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_BLOCKS_H_
