// Choice of the base cell size of the hash grid from a sample of its values. The choice affects only cost, never the
// result of a query. Pure functions; any thread.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_CELL_SIZE_H_
#define LOCUS_CORE_INDEX_HASH_GRID_CELL_SIZE_H_

#include <algorithm>
#include <cstddef>
#include <vector>

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/geometry/aabb.h"

namespace locus::internal {

// Approximate number of sampled values.
inline constexpr size_t kCellSizeSample = 2048;
// Let the mean of a cell size be the mean number of other values in the cell of a random value. choose_cell_exponent()
// accepts a mean up to kMaxMeanPerCell or, if larger, kMaxAddedPerCell plus the mean of the smallest cell size that it
// considers.
inline constexpr double kMaxMeanPerCell = 24;
inline constexpr double kMaxAddedPerCell = 12;
// cell_exponent_fits() accepts a cell size if the mean of this cell size, as defined above, is in this range.
inline constexpr double kMinOthersPerCell = 6;
inline constexpr double kMaxOthersPerCell = 64;

struct SampledValue {
  Vec3d position;
  double diameter = 0;
};

// Returns the exponent e of the largest cell edge 2^e at which a random value shares its cell with at most
// kMaxMeanPerCell other values on average. The edge is at least the median diameter of the values. The edge is not
// much larger than the bounds of all values, unless the median diameter requires a larger edge. The mean is estimated
// for `population` values, of which `sample` is an evenly spaced selection. Values that share a cell at every cell size
// raise the limit (see kMaxAddedPerCell), so they do not prevent larger cells. Preconditions: `sample` is not empty,
// population >= sample.size(). Cost: at most seven counts of the sample's cells.
int choose_cell_exponent(absl::Span<const SampledValue> sample, size_t population);

// Returns true if cells with an edge of 2^exponent are still suitable: a random value shares its cell with
// kMinOthersPerCell to kMaxOthersPerCell other values on average. Costs one count of the sample's cells, less than
// choose_cell_exponent().
bool cell_exponent_fits(absl::Span<const SampledValue> sample, size_t population, int exponent);

// Evenly spaced sample of `population` values, which are offered one by one. Selects all values if `population` is less
// than kCellSizeSample, else kCellSizeSample to 2 * kCellSizeSample values.
class EvenSample {
 public:
  explicit EvenSample(size_t population) : stride_(std::max<size_t>(1, population / kCellSizeSample)) {}
  void offer(Vec3d position, double diameter) {
    if (offered_++ % stride_ == 0) values_.push_back({position, diameter});
    LOCUS_DCHECK_LE(values_.size(), 2 * kCellSizeSample);
  }
  absl::Span<const SampledValue> values() const { return values_; }
  // Returns the bounds of the selected positions.
  Aabbd bounds() const {
    Aabbd bounds;
    for (const SampledValue& value : values_) bounds = merge(bounds, Aabbd{value.position, value.position});
    return bounds;
  }

 private:
  size_t stride_;
  size_t offered_ = 0;
  std::vector<SampledValue> values_;
};
}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_CELL_SIZE_H_
