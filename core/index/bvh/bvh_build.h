// Builds the layout of a bounding volume hierarchy from boxes alone: a binary tree by the binned surface area
// heuristic, then collapsed to nodes of eight at the least cost. Any finite input gives a tree within the depth limit
// and with fewer than two nodes a value; equal input and options give an equal tree, on any number of threads. Pure
// functions: may run concurrently. Sources: binary_tree.h, wide_choice.h.
#ifndef LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_
#define LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_

#include <atomic>
#include <functional>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/index/bvh/bvh_node.h"

namespace locus {

// Of the trees that are built for the same input. Raised with every change that makes other ones, so that what was
// kept of the trees before (tree_outline.h) is not taken for the best that can be had.
inline constexpr uint32_t kBvhBuilderVersion = 1;

struct BvhOptions {
  // Split candidates an axis plus one, 2 to limits::kMaxBvhBins. More bins find slightly better trees and take longer;
  // answers do not depend on them.
  int bins = 32;
  // When it becomes true, to stay so, the build ends soon with CANCELLED. May be null; must outlive the build.
  const std::atomic<bool>* cancel = nullptr;
  // Calls its second argument for each number below the first, on any threads, and returns when all calls have. Trees
  // do not depend on it. [in order, on this thread]
  std::function<void(size_t, const std::function<void(size_t)>&)> parallel_for;
};

// Whether the build was told to end.
inline bool cancelled(const BvhOptions& options) {
  return options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed);
}

// Calls work(0) .. work(count - 1) by BvhOptions::parallel_for.
inline void for_each(const BvhOptions& options, size_t count, const std::function<void(size_t)>& work) {
  if (options.parallel_for) {
    options.parallel_for(count, work);
  } else {
    for (size_t i = 0; i < count; ++i) work(i);
  }
}

// INVALID_ARGUMENT for options out of range, RESOURCE_EXHAUSTED for too many values.
absl::Status check_build(size_t values, const BvhOptions& options);
absl::Status cancelled_build();
// INVALID_ARGUMENT for a value whose bounds are not finite, by its index.
absl::Status refuse_bounds(size_t index);

// Errors: INVALID_ARGUMENT for a box that is not finite or empty and for bins out of range, RESOURCE_EXHAUSTED beyond
// limits::kMaxBvhValues, CANCELLED. Cost: O(n log n) for input of ordinary spread, O(n * kMaxBvhDepth) for any.
// Defined for float and double.
template <class S>
absl::StatusOr<BvhLayout<S>> build_bvh_layout(absl::Span<const Aabb<S>> boxes, const BvhOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_
