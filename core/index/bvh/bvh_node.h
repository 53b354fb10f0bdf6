// How a bounding volume hierarchy lies in memory. Plain data, shared by the builder, which knows only boxes, and by
// Bvh, which knows the values.
#ifndef LOCUS_CORE_INDEX_BVH_BVH_NODE_H_
#define LOCUS_CORE_INDEX_BVH_BVH_NODE_H_

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/aabb.h"

namespace locus {

inline constexpr uint32_t kBvhWidth = 8;     // children of a node
inline constexpr uint32_t kBvhLeafSize = 8;  // values of a leaf, at most

// What a child slot refers to: `count` values from `first` on, or node `first` where count is 0. Without defaults, so
// that the stack of a visit costs nothing to set up.
struct BvhChild {
  uint32_t first;
  uint32_t count;

  bool is_leaf() const { return count != 0; }
};

// Slots from child_count on are unused.
template <class S>
struct BvhNode {
  std::array<Aabb<S>, kBvhWidth> bounds;
  std::array<BvhChild, kBvhWidth> children{};
  uint32_t child_count = 0;
};

// Node 0 is the root; nodes stand in depth-first order, and so do the values: position i of the tree holds value
// order[i] of the input, and every subtree is one contiguous range of positions. All empty for no values.
template <class S>
struct BvhLayout {
  std::vector<BvhNode<S>> nodes;
  std::vector<uint32_t> order;
  Aabb<S> bounds;
  uint32_t depth = 0;  // levels of nodes, at most limits::kMaxBvhDepth
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_NODE_H_
