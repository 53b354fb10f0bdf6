#include "tests/bench/dynamic/check_values.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_format.h"

namespace locus::bench::dynamic {
namespace {

// As printed: rounded to their last digit.
struct Known {
  Kind kind;
  uint32_t count;
  double ball, box;           // ids a query
  double ray_share, ray_sum;  // rays that hit, and the sum of their distances
};
constexpr Known kKnown[] = {
    {Kind::kUniform, 10'000, 0.97, 1.16, 0.0058, 1131.4},
    {Kind::kUniform, 100'000, 2.01, 3.11, 0.0203, 8048.2},
    {Kind::kClustered, 100'000, 6.83, 12.13, 0.0740, 30673.4},
    {Kind::kUniform, 1'000'000, 12.53, 22.70, 0.1574, 69668.0},
    {Kind::kClustered, 1'000'000, 60.58, 112.38, 0.4474, 148473.6},
};

void expect(const std::string& what, double value, double known, double tolerance, Report& report) {
  if (std::fabs(value - known) > tolerance)
    report.disagreements.push_back(absl::StrFormat("%s is %.4f, and must be %.4f", what, value, known));
}

}  // namespace

uint32_t ticks_before_queries(uint32_t count) { return std::clamp<uint32_t>(3'000'000 / count, 3, 20); }

void check_values(const std::string& case_name, Task task, const World& world, const std::string& contender,
                  const Answers& answers, Report& report) {
  const auto known = std::find_if(std::begin(kKnown), std::end(kKnown), [&](const Known& one) {
    return one.kind == world.kind() && one.count == world.count();
  });
  if (known == std::end(kKnown) || answers.counts.size() != kQueries) return;
  const std::string who = case_name + ", " + contender;
  const double found = static_cast<double>(answers.ids.size()) / kQueries;
  if (task == Task::kBall) expect(who + ": ids a ball", found, known->ball, 0.0051, report);
  if (task == Task::kBox) expect(who + ": ids a box", found, known->box, 0.0051, report);
  if (task != Task::kRay) return;
  const double sum = std::accumulate(answers.distances.begin(), answers.distances.end(), 0.0);
  expect(who + ": share of rays that hit", found, known->ray_share, 0.000051, report);
  expect(who + ": sum of distances", sum, known->ray_sum, 0.051, report);
}

}  // namespace locus::bench::dynamic
