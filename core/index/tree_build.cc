#include "core/index/tree_build.h"

#include <optional>

#include "core/base/limits.h"
#include "core/base/refusal.h"

namespace locus {

absl::Status check_build(size_t values, const BvhOptions& options) {
  if (options.bins < 2 || options.bins > static_cast<int>(limits::kMaxBvhBins))
    return refuse_argument(Reason::kOutOfRange, "bins", std::nullopt, "must be 2 to 64");
  if (values > limits::kMaxBvhValues)
    return refuse_limit("values", "max_bvh_values", limits::kMaxBvhValues, static_cast<double>(values));
  return absl::OkStatus();
}

absl::Status cancelled_build() { return absl::CancelledError("the build of the tree was cancelled"); }

absl::Status refuse_bounds(size_t index) {
  return refuse_argument(Reason::kNotFinite, "values", static_cast<uint32_t>(index), "its bounds must be finite");
}

}  // namespace locus
