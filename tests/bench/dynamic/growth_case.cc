#include "tests/bench/dynamic/growth_case.h"

#include <cmath>

#include "tests/bench/dynamic/query_cases.h"
#include "tests/bench/frame/race.h"

namespace locus::bench::dynamic {
namespace {

// Returns the side of a uniform world in which `count` objects are as dense as 100,000 in a world of side kSide.
float side_of(uint32_t count) { return kSide * std::sqrt(static_cast<float>(count) / 100'000); }

struct Grown {
  explicit Grown(uint32_t count) : world(Kind::kUniform, count, side_of(count)), queries(queries_of(world)) {
    ours.load(world.objects());
  }
  Contestant contestant(size_t passes) {
    const auto run = [this, passes](size_t) {
      for (size_t pass = 0; pass < passes; ++pass) {
        answers.clear();
        ours.balls(queries.centers, answers);
      }
    };
    return {name_of_count(world.count()), run, static_cast<double>(queries.centers.size() * passes), {}};
  }

  World world;
  Queries queries;
  Ours ours;
  Answers answers;
};

}  // namespace

void run_growth_case(const Options& options, const Progress& progress, Report& report) {
  const std::string name = "growth/ball";
  if (!options.filter.wants(name)) return;
  progress(name);
  const auto large = std::make_unique<Grown>(options.quick ? 100'000 : 1'000'000);
  const auto small = std::make_unique<Grown>(10'000);
  const size_t passes = options.quick ? 1 : 10;
  const std::vector<Contestant> contestants = {large->contestant(passes), small->contestant(passes)};
  const auto times = race(contestants, 1, options.rounds, thread_seconds);
  add_cells(contestants, times, cell_of(name, "ns/query", hash_of(large->answers)), report);
}

}  // namespace locus::bench::dynamic
