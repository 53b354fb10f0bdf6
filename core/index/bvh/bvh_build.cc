#include "core/index/bvh/bvh_build.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "core/index/binary_tree.h"
#include "core/index/bvh/wide_children.h"

namespace locus {
namespace {

// Writes the wide nodes of `tree` to `layout` in depth-first order.
template <class S>
void collapse(const BinaryTree<S>& tree, BvhLayout<S>& layout) {
  struct Pending {
    const BinaryNode<S>* root;
    uint32_t parent, slot;  // node and child slot in which the index of the new node is stored
    uint32_t depth;
  };
  std::vector<Pending> pending = {{&tree.root(), 0, 0, 1}};
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    const uint32_t index = static_cast<uint32_t>(layout.nodes.size());
    if (index != 0) layout.nodes[now.parent].children[now.slot] = {index, 0};
    BvhNode<S>& node = layout.nodes.emplace_back();
    layout.depth = std::max(layout.depth, now.depth);
    const WideChildren<S> children(*now.root);
    node.child_count = children.size();
    // Pushes in reverse order, so that the first child is the next one popped: depth-first order.
    for (uint32_t slot = node.child_count; slot-- > 0;) {
      const BinaryNode<S>& child = children[slot];
      node.bounds[slot] = child.bounds;
      if (child.is_leaf()) {
        node.children[slot] = {child.first, child.count};
      } else {
        pending.push_back({&child, index, slot, now.depth + 1});
      }
    }
  }
}

// Verifies the invariants of BvhLayout in debug builds: depth-first order, nested bounds, sizes and depth. O(n).
template <class S>
void check_layout(const BvhLayout<S>& layout, absl::Span<const Aabb<S>> boxes) {
  struct Pending {
    BvhChild child;
    Aabb<S> bounds;
    uint32_t depth;
  };
  std::vector<Pending> pending = {{{0, 0}, layout.bounds, 1}};
  uint32_t next_node = 0, next_position = 0, depth = 0;
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    if (now.child.is_leaf()) {
      LOCUS_DCHECK_EQ(now.child.first, next_position);
      LOCUS_DCHECK_LE(now.child.count, kBvhLeafSize);
      for (; next_position < now.child.first + now.child.count; ++next_position)
        LOCUS_DCHECK(contains(now.bounds, boxes[layout.order[next_position]]));
      continue;
    }
    LOCUS_DCHECK_EQ(now.child.first, next_node);
    depth = std::max(depth, now.depth);
    const BvhNode<S>& node = layout.nodes[next_node++];
    LOCUS_DCHECK(0 < node.child_count && node.child_count <= kBvhWidth);
    for (uint32_t slot = node.child_count; slot-- > 0;) {
      LOCUS_DCHECK(contains(now.bounds, node.bounds[slot]));
      pending.push_back({node.children[slot], node.bounds[slot], now.depth + 1});
    }
  }
  LOCUS_DCHECK_EQ(next_node, layout.nodes.size());
  LOCUS_DCHECK_EQ(next_position, boxes.size());
  LOCUS_DCHECK_EQ(depth, layout.depth);
}

}  // namespace

template <class S>
absl::StatusOr<BvhLayout<S>> build_bvh_layout(absl::Span<const Aabb<S>> boxes, const BvhOptions& options) {
  RETURN_IF_ERROR(check_build(boxes.size(), options));
  BvhLayout<S> layout;
  if (boxes.empty()) return layout;
  auto references = std::make_unique_for_overwrite<BoxReference<S>[]>(boxes.size());
  for (size_t i = 0; i < boxes.size(); ++i) {
    if (!is_finite(boxes[i].min) || !is_finite(boxes[i].max) || boxes[i].empty()) return refuse_bounds(i);
    references[i] = BoxReference<S>::of(QuadBox<S>::of(boxes[i]), static_cast<uint32_t>(i));
  }
  const auto count = static_cast<uint32_t>(boxes.size());
  ASSIGN_OR_RETURN(BinaryTree<S> tree, BinaryTree<S>::build(std::move(references), count, options));
  collapse(tree, layout);
  layout.bounds = tree.root().bounds;
  layout.order.reserve(count);
  for (uint32_t position = 0; position < count; ++position) layout.order.push_back(tree.index(position));
  LOCUS_CHECK_LE(layout.depth, limits::kMaxBvhDepth);
  LOCUS_CHECK_LT(layout.nodes.size(), 2 * boxes.size());
  check_layout<S>(layout, boxes);
  return layout;
}

template absl::StatusOr<BvhLayout<float>> build_bvh_layout(absl::Span<const Aabbf>, const BvhOptions&);
template absl::StatusOr<BvhLayout<double>> build_bvh_layout(absl::Span<const Aabbd>, const BvhOptions&);

}  // namespace locus
