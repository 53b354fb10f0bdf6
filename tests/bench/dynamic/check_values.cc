#include "tests/bench/dynamic/check_values.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_format.h"

namespace locus::bench::dynamic {
namespace {

// Expected results of one world, rounded to the last digit that is given.
struct Known {
  Kind kind;
  uint32_t count;
  double ball, box;           // mean number of ids per query
  double ray_share, ray_sum;  // share of rays that hit an object, and sum of the distances at which they hit
  double nearest_sum;         // sum of the distances to the centres of the nearest objects
};
constexpr Known kKnown[] = {
    {Kind::kUniform, 10'000, 0.97, 1.16, 0.0058, 1131.4, 2419380.3},
    {Kind::kUniform, 100'000, 2.01, 3.11, 0.0203, 8048.2, 1126110.1},
    {Kind::kClustered, 100'000, 6.83, 12.13, 0.0740, 30673.4, 855237.9},
    {Kind::kUniform, 1'000'000, 12.53, 22.70, 0.1574, 69668.0, 532566.2},
    {Kind::kClustered, 1'000'000, 60.58, 112.38, 0.4474, 148473.6, 408275.4},
};

void expect(const std::string& what, double value, double known, double tolerance, Report& report) {
  if (std::fabs(value - known) > tolerance)
    report.disagreements.push_back(absl::StrFormat("%s is %.4f, and must be %.4f", what, value, known));
}

double distance_to_centers(const World& world, const Queries& queries, const Answers& answers) {
  const Objects objects = world.objects();
  absl::flat_hash_map<uint64_t, size_t> numbers;
  numbers.reserve(objects.ids.size());
  for (size_t i = 0; i < objects.ids.size(); ++i) numbers.emplace(objects.ids[i], i);
  double sum = 0;
  auto next = answers.ids.begin();
  for (size_t query = 0; query < answers.counts.size(); ++query) {
    for (uint32_t i = 0; i < answers.counts[query]; ++i, ++next) {
      const Vec3f center = point_at(objects.positions, numbers.at(*next));
      sum += std::sqrt(squared_length(to_double(center) - to_double(queries.centers[query])));
    }
  }
  return sum;
}

}  // namespace

uint32_t ticks_before_queries(uint32_t count) { return std::clamp<uint32_t>(3'000'000 / count, 3, 20); }

void check_values(const std::string& case_name, Task task, const World& world, const Queries& queries,
                  const std::string& contender, const Answers& answers, Report& report) {
  const auto known = std::find_if(std::begin(kKnown), std::end(kKnown), [&](const Known& one) {
    return one.kind == world.kind() && one.count == world.count();
  });
  if (known == std::end(kKnown) || answers.counts.size() != kQueries) return;
  const std::string who = case_name + ", " + contender;
  const double found = static_cast<double>(answers.ids.size()) / kQueries;
  if (task == Task::kBall) expect(who + ": ids a ball", found, known->ball, 0.0051, report);
  if (task == Task::kBox) expect(who + ": ids a box", found, known->box, 0.0051, report);
  if (task == Task::kNearest)
    expect(who + ": sum of distances to centres", distance_to_centers(world, queries, answers), known->nearest_sum,
           0.051, report);
  if (task != Task::kRay) return;
  const double sum = std::accumulate(answers.distances.begin(), answers.distances.end(), 0.0);
  expect(who + ": share of rays that hit", found, known->ray_share, 0.000051, report);
  expect(who + ": sum of distances", sum, known->ray_sum, 0.051, report);
}

}  // namespace locus::bench::dynamic
