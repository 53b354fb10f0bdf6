// The choice of the grid's base cell size from a sample of what it holds. It decides cost only, never an answer.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_CELL_SIZE_H_
#define LOCUS_CORE_INDEX_HASH_GRID_CELL_SIZE_H_

#include <algorithm>
#include <cstddef>
#include <vector>

#include "absl/types/span.h"
#include "core/geometry/vec3.h"

namespace locus::internal {

inline constexpr size_t kCellSizeSample = 2048;   // values looked at for one choice, about
inline constexpr double kMaxMeanPerCell = 24;     // values that share the cell of a random value, at most ...
inline constexpr double kMeanPerCellMargin = 12;  // ... or so many more than at the smallest sensible cell

inline constexpr double kFewestServing = 6;  // a choice is kept while as many share a cell, at least ...
inline constexpr double kMaxServing = 64;    // ... and at most

struct SampledValue {
  Vec3d position;
  double diameter = 0;
};

// The exponent of the largest cell edge, at least the median diameter, at which a random value shares its cell with at
// most kMaxMeanPerCell others on average, estimated for `population` values of which `sample` is an even selection.
// Values that no cell size separates do not count against larger cells; but for the diameter, no cell is much wider
// than all values together. `sample` is not empty. Cost: at most about fifty sorts of the sample. Pure.
int choose_cell_exponent(absl::Span<const SampledValue> sample, size_t population);

// Whether cells of that exponent still do: a random value shares its cell with neither too few others nor too many. For
// the many times when nothing has changed: one sort of the sample instead of fifty. Pure.
bool cell_exponent_serves(absl::Span<const SampledValue> sample, size_t population, int exponent);

// Every value whose turn it is in an even selection of about kCellSizeSample of `population`.
class EvenSample {
 public:
  explicit EvenSample(size_t population) : stride_(std::max<size_t>(1, population / kCellSizeSample)) {}
  void offer(Vec3d position, double diameter) {
    if (offered_++ % stride_ == 0) values_.push_back({position, diameter});
  }
  absl::Span<const SampledValue> values() const { return values_; }

 private:
  size_t stride_;
  size_t offered_ = 0;
  std::vector<SampledValue> values_;
};
}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_CELL_SIZE_H_
