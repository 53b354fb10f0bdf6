#include "core/index/hash_grid/cell_size.h"

#include <algorithm>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/check.h"
#include "core/index/hash_grid/cell_key.h"

namespace locus::internal {
namespace {

double median_diameter(absl::Span<const SampledValue> sample) {
  std::vector<double> diameters;
  diameters.reserve(sample.size());
  for (const SampledValue& value : sample) diameters.push_back(value.diameter);
  const auto middle = diameters.begin() + static_cast<std::ptrdiff_t>(diameters.size() / 2);
  std::nth_element(diameters.begin(), middle, diameters.end());
  return *middle;
}

// Returns the largest useful exponent: wider cells would separate no values, and the float columns of their bricks
// would lose all precision.
int exponent_of_all(absl::Span<const SampledValue> sample) {
  Vec3d low = sample[0].position, high = low;
  for (const SampledValue& value : sample) {
    low = min(low, value.position);
    high = max(high, value.position);
  }
  const double width = max_component(high - low), magnitude = max_component(max(abs(low), abs(high)));
  // If all values coincide, `width` is zero. The term with the magnitude then prevents tiny cells: a value would leave
  // a tiny cell with every move.
  return exponent_covering(std::max(4 * width, 0x1p-16 * magnitude), kMinCellExponent, kMaxBaseExponent);
}

// Returns the expected number of other values in the cell of a random value. The estimate assumes that the fraction of
// pairs of values that share a cell is the same in the sample and in all values, so the sample size causes no bias.
double mean_others_per_cell(absl::Span<const SampledValue> sample, size_t population, int exponent) {
  if (sample.size() < 2) return 0;
  absl::flat_hash_map<GridKey, uint32_t, GridKeyHash> counts;
  counts.reserve(sample.size());
  const double per_unit = cells_per_unit(exponent);
  double pairs = 0;  // ordered pairs of values that share a cell
  for (const SampledValue& value : sample) pairs += 2.0 * counts[cell_of(value.position, per_unit)]++;
  const double share = pairs / (static_cast<double>(sample.size()) * static_cast<double>(sample.size() - 1));
  return share * static_cast<double>(population - 1);
}

}  // namespace

int choose_cell_exponent(absl::Span<const SampledValue> sample, size_t population) {
  LOCUS_CHECK(!sample.empty() && population >= sample.size());
  int exponent = exponent_covering(median_diameter(sample), kMinCellExponent, kMaxBaseExponent);  // always suitable
  const double allowed =
      std::max(kMaxMeanPerCell, mean_others_per_cell(sample, population, exponent) + kMaxAddedPerCell);
  // Two values that share a cell share each wider cell, too, so the mean never falls with the exponent.
  int max_exponent = exponent_of_all(sample);
  while (exponent < max_exponent) {
    const int middle = exponent + (max_exponent - exponent + 1) / 2;
    if (mean_others_per_cell(sample, population, middle) <= allowed) {
      exponent = middle;
    } else {
      max_exponent = middle - 1;
    }
  }
  LOCUS_DCHECK_GE(exponent, kMinCellExponent);
  LOCUS_DCHECK_LE(exponent, kMaxBaseExponent);
  return exponent;
}

bool cell_exponent_fits(absl::Span<const SampledValue> sample, size_t population, int exponent) {
  LOCUS_DCHECK_GE(population, sample.size());
  const double others = mean_others_per_cell(sample, population, exponent);
  return others >= kMinOthersPerCell && others <= kMaxOthersPerCell;
}

}  // namespace locus::internal
