#include "client/cli/extras/tune/cell_choice.h"

#include <algorithm>
#include <cstdlib>
#include <set>

#include "core/base/check.h"

namespace locus::cli {

double weighted_time(const std::map<std::string, KindCost>& kinds, const KindWeights& weights) {
  double sum = 0;
  for (const auto& [kind, cost] : kinds) {
    const auto weight = weights.find(kind);
    if (weight != weights.end()) sum += weight->second * cost.nanoseconds;
  }
  return sum;
}

KindWeights equal_weights(const std::map<std::string, KindCost>& present) {
  KindWeights weights;
  for (const auto& [kind, cost] : present) weights[kind] = 1 / std::max(cost.nanoseconds, 1.0);
  return weights;
}

std::vector<int> next_exponents(const std::map<int, double>& times, int present) {
  std::set<int> next;
  const auto add = [&](int exponent) {
    const int low = std::max(present - kSearchReach, kMinExponent),
              high = std::min(present + kSearchReach, kMaxExponent);
    if (exponent >= low && exponent <= high && !times.contains(exponent)) next.insert(exponent);
  };
  if (times.empty()) {
    for (const int step : {-4, -2, 0, 2, 4}) add(present + step);
    return {next.begin(), next.end()};
  }
  const auto better = [present](const auto& a, const auto& b) {
    if (a.second != b.second) return a.second < b.second;
    return std::abs(a.first - present) < std::abs(b.first - present);
  };
  const int best = std::min_element(times.begin(), times.end(), better)->first;
  add(best - 1);
  add(best + 1);
  if (best == times.begin()->first) add(best - 2);
  if (best == times.rbegin()->first) add(best + 2);
  return {next.begin(), next.end()};
}

SizeChoice choose_size(absl::Span<const SizeFigures> figures, double setting) {
  const auto faster = [](const SizeFigures& a, const SizeFigures& b) {
    return a.is_confirmed != b.is_confirmed ? a.is_confirmed : a.relative < b.relative;
  };
  const auto best = std::min_element(figures.begin(), figures.end(), faster);
  LOCUS_CHECK(best != figures.end() && best->is_confirmed);
  const auto is_worth_it = [](const SizeFigures& one) { return 100 * (1 - one.relative) >= kMinGainPercent; };
  auto named = best;
  for (auto one = figures.begin(); one != figures.end(); ++one) {
    if (one->setting != 0 || !one->is_confirmed || one->relative > best->relative * (1 + kChosenAllowance)) continue;
    if (one->is_present || is_worth_it(*one) || !is_worth_it(*best)) named = one;
  }
  SizeChoice choice;
  choice.index = static_cast<size_t>(named - figures.begin());
  const bool chosen_anew = named->setting == 0 && setting == 0 && !named->is_present;
  choice.cell_size = chosen_anew ? named->cell_size : named->setting;
  choice.gain_percent = 100 * (1 - named->relative);
  choice.leave_it = named->is_present || choice.gain_percent < kMinGainPercent;
  return choice;
}

}  // namespace locus::cli
