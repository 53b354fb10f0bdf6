// Memory layout of a bounding volume hierarchy. Plain data, shared by the builder, which reads only boxes, and by Bvh,
// which stores the values.
#ifndef LOCUS_CORE_INDEX_BVH_BVH_NODE_H_
#define LOCUS_CORE_INDEX_BVH_BVH_NODE_H_

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/aabb.h"
#include "core/index/tree_build.h"

namespace locus {

// Content of a child slot. A leaf (count > 0) holds the values at positions first .. first + count - 1; an inner child
// (count == 0) is the node at index `first`. No default member initializers, so that a visit need not initialize its
// stack array.
struct BvhChild {
  uint32_t first;
  uint32_t count;

  bool is_leaf() const { return count != 0; }
};

// One node: bounds and content of up to eight children. Slots from child_count on are unused.
template <class S>
struct BvhNode {
  std::array<Aabb<S>, kBvhWidth> bounds;
  std::array<BvhChild, kBvhWidth> children{};
  uint32_t child_count = 0;
};

// Tree over boxes, as the builder returns it. Node 0 is the root. Nodes and values are stored in depth-first order:
// position i of the tree holds the value at index order[i] of the input, and the values of a subtree have contiguous
// positions. For an input without values, `nodes`, `order` and `bounds` are empty.
template <class S>
struct BvhLayout {
  std::vector<BvhNode<S>> nodes;
  std::vector<uint32_t> order;
  Aabb<S> bounds;
  uint32_t depth = 0;  // number of levels of nodes, at most limits::kMaxBvhDepth
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_NODE_H_
