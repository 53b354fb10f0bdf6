// Builds the layout of a bounding volume hierarchy from boxes: first a binary tree by the binned surface area
// heuristic, which is then collapsed to nodes of eight children at the least cost. Any finite input results in a tree
// within the depth limit and with fewer than two nodes a value. Equal input and options result in an equal tree, on any
// number of threads. Pure functions: may run concurrently. Sources: binary_tree.h, wide_choice.h.
#ifndef LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_
#define LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_

#include <atomic>
#include <functional>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/index/bvh/bvh_node.h"

namespace locus {

// Version of the build algorithm. Must be incremented with every change that results in other trees for the same input,
// so that stored topologies of older builds (tree_topology.h) are recognised as possibly worse than a new build.
inline constexpr uint32_t kBvhBuilderVersion = 1;

struct BvhOptions {
  // Number of bins an axis, 2 to limits::kMaxBvhBins; each border between two bins is a candidate for a split. More
  // bins find slightly better trees and take longer; answers do not depend on them.
  int bins = 32;
  // Cancel flag. When it becomes true, the build ends soon with CANCELLED; it must not become false again. May be null;
  // must outlive the build.
  const std::atomic<bool>* cancel = nullptr;
  // Calls its second argument for each index below the first argument, on any threads, and returns when all calls have
  // returned. Trees do not depend on it. [default: calls in order on this thread]
  std::function<void(size_t, const std::function<void(size_t)>&)> parallel_for;
};

// Returns whether the cancel flag is set.
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

// Verifies the arguments of a build: INVALID_ARGUMENT for options out of range, RESOURCE_EXHAUSTED for more than
// limits::kMaxBvhValues values.
absl::Status check_build(size_t values, const BvhOptions& options);
// Returns CANCELLED.
absl::Status cancelled_build();
// Returns INVALID_ARGUMENT for the value at `index`, whose bounds are not finite.
absl::Status refuse_bounds(size_t index);

// Builds a tree over `boxes`. Errors: INVALID_ARGUMENT for an empty box, a box that is not finite, or bins out of
// range; RESOURCE_EXHAUSTED for more than limits::kMaxBvhValues boxes; CANCELLED. Cost: O(n log n) for input of
// ordinary spread, O(n * kMaxBvhDepth) for any input. Defined for float and double.
template <class S>
absl::StatusOr<BvhLayout<S>> build_bvh_layout(absl::Span<const Aabb<S>> boxes, const BvhOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_BUILD_H_
