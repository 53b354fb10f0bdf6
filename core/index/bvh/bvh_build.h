// Builds the layout of a bounding volume hierarchy from boxes alone: a binary tree by the binned surface area
// heuristic, then collapsed to nodes of eight. Any finite input gives a tree within the depth limit and with fewer than
// two nodes a value; equal input and options give an equal tree. Pure functions: may run concurrently. Source: Wald, On
// fast Construction of SAH-based Bounding Volume Hierarchies, 2007 (binning); Wald, Benthin, Boulos, Getting Rid of
// Packets, 2008 (collapsing to wide nodes by area).
#ifndef LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_
#define LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_

#include <atomic>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/index/bvh/bvh_node.h"

namespace locus {

struct BvhOptions {
  // Split candidates an axis plus one, 2 to limits::kMaxBvhBins. More bins find slightly better trees and take longer;
  // answers do not depend on them.
  int bins = 32;
  // When it becomes true the build ends soon with CANCELLED. May be null; must outlive the build.
  const std::atomic<bool>* cancel = nullptr;
};

// Errors: INVALID_ARGUMENT for a box that is not finite or empty and for bins out of range, RESOURCE_EXHAUSTED beyond
// limits::kMaxBvhValues, CANCELLED. Cost: O(n log n) for input of ordinary spread, O(n * kMaxBvhDepth) for any.
// Defined for float and double.
template <class S>
absl::StatusOr<BvhLayout<S>> build_bvh_layout(absl::Span<const Aabb<S>> boxes, const BvhOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_
