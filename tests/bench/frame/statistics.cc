#include "tests/bench/frame/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace locus::bench {

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

double percentile(std::vector<double> values, double share) {
  const auto rank = static_cast<size_t>(std::ceil(share * static_cast<double>(values.size())));
  const auto place = values.begin() + static_cast<ptrdiff_t>(rank == 0 ? 0 : rank - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

double spread(const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return (*most - *least) / median(values);
}

std::vector<double> round_ratios(const std::vector<double>& ours, const std::vector<double>& peer) {
  std::vector<double> ratios(ours.size());
  std::transform(peer.begin(), peer.end(), ours.begin(), ratios.begin(), [](double p, double o) { return p / o; });
  return ratios;
}

}  // namespace locus::bench
