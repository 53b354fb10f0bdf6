// Options of the builders of trees over boxes, and the checks and errors that these builders share. Pure functions; may
// run concurrently.
#ifndef LOCUS_CORE_INDEX_TREE_BUILD_H_
#define LOCUS_CORE_INDEX_TREE_BUILD_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "absl/status/status.h"

namespace locus {

inline constexpr uint32_t kBvhWidth = 8;     // maximum number of children of a node
inline constexpr uint32_t kBvhLeafSize = 8;  // maximum number of values in a leaf

struct BvhOptions {
  // Maximum number of bins on each axis, 2 to limits::kMaxBvhBins; each border between two bins is a candidate for a
  // split. More bins result in slightly better trees and longer builds; answers to queries do not depend on the number.
  int bins = 32;
  // Cancel flag, null if the build cannot be cancelled. When the flag becomes true, the build ends soon with CANCELLED.
  // The flag must not become false again and must outlive the build.
  const std::atomic<bool>* cancel = nullptr;
  // Function that calls its second argument with each index below its first argument, on any threads, and returns when
  // all calls have returned. The resulting tree does not depend on the threads or their order. If empty, the build
  // makes the calls in order on its own thread.
  std::function<void(size_t, const std::function<void(size_t)>&)> parallel_for;
};

// Returns whether the cancel flag is set.
inline bool cancelled(const BvhOptions& options) {
  return options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed);
}

// Calls work(0) .. work(count - 1) using options.parallel_for, or in order on this thread if parallel_for is empty.
inline void for_each(const BvhOptions& options, size_t count, const std::function<void(size_t)>& work) {
  if (options.parallel_for) {
    options.parallel_for(count, work);
  } else {
    for (size_t i = 0; i < count; ++i) work(i);
  }
}

// Verifies the arguments of a build of `values` values. Returns INVALID_ARGUMENT if options.bins is out of range or
// there are more than limits::kMaxBvhValues values.
absl::Status check_build(size_t values, const BvhOptions& options);
// Returns the error CANCELLED for a build whose cancel flag was set.
absl::Status cancelled_build();
// Returns INVALID_ARGUMENT for the value at `index`, whose bounds are empty or not finite.
absl::Status refuse_bounds(size_t index);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_TREE_BUILD_H_
