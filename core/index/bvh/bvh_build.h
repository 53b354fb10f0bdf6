// Builds the layout of a bounding volume hierarchy from boxes. The build makes a binary tree using the binned surface
// area heuristic, and then collapses this tree to nodes of up to eight children at minimum cost. Any finite input
// results in a tree within the depth limit and with fewer than two nodes per value. Equal input and options result in
// an equal tree, on any number of threads. Pure functions: may run concurrently. Sources: binary_tree.h, wide_choice.h.
#ifndef LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_
#define LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/index/bvh/bvh_node.h"
#include "core/index/tree_build.h"

namespace locus {

// Version of the build algorithm. Must be incremented whenever a change of the algorithm changes the tree of some
// input, so that stored topologies of older builds (tree_topology.h) are recognised as possibly worse than a new build.
inline constexpr uint32_t kBvhBuilderVersion = 1;

// Builds a tree over `boxes`. Errors: INVALID_ARGUMENT for an empty box, a box that is not finite, bins out of range,
// or more than limits::kMaxBvhValues boxes; CANCELLED if the cancel flag was set. Cost: typically O(n log n); in the
// worst case O(n * kMaxBvhDepth). Defined for float and double.
template <class S>
absl::StatusOr<BvhLayout<S>> build_bvh_layout(absl::Span<const Aabb<S>> boxes, const BvhOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_
