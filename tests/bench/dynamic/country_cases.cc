#include "tests/bench/dynamic/country_cases.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "tests/bench/dynamic/query_cases.h"
#include "tests/bench/frame/heap.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"

namespace locus::bench::dynamic {
namespace {

constexpr std::array<Kind, 3> kHubs = {Kind::kHub20, Kind::kHub60, Kind::kHub200};
constexpr size_t kCountryQueries = 1000;
constexpr float kFarFromHub = 300;  // min distance in x or y of a query from the centre of the hub
constexpr size_t kTicksBefore = 3;  // ticks before the queries

struct CountryCase {
  const char* name;
  Task task;
};
constexpr std::array<CountryCase, 4> kCountryCases = {{{"country/ball", Task::kBall},
                                                       {"country/box", Task::kBox},
                                                       {"country/ray", Task::kRay},
                                                       {"country/nearest", Task::kNearest}}};

std::string country_case(const char* name, const World& world) { return absl::StrCat(name, "/", world.name()); }

// Columns of the objects of a world that start outside the hub.
class Country {
 public:
  explicit Country(const World& world) { gather(world); }
  void gather(const World& world) {
    ids_.clear(), positions_.clear(), velocities_.clear(), radii_.clear();
    const Objects objects = world.objects();
    const Moves moves = world.moves();
    for (size_t i = 0; i < objects.ids.size(); ++i) {
      if (starts_in_hub(i)) continue;
      ids_.push_back(objects.ids[i]);
      radii_.push_back(objects.radii[i]);
      for (size_t axis = 0; axis < 3; ++axis) {
        positions_.push_back(objects.positions[3 * i + axis]);
        velocities_.push_back(moves.velocities[3 * i + axis]);
      }
    }
  }
  Objects objects() const { return {ids_, positions_, radii_}; }
  Moves moves() const { return {ids_, positions_, velocities_}; }

 private:
  std::vector<uint64_t> ids_;
  std::vector<float> positions_, velocities_, radii_;
};

Queries country_queries(const World& world) {
  const auto is_far = [](const Vec3f& point) {
    return std::max(std::abs(point.x - kSide / 2), std::abs(point.y - kSide / 2)) > kFarFromHub;
  };
  const Queries all = queries_of(world, 4 * kCountryQueries);
  Queries far;
  for (size_t i = 0; i < all.centers.size(); ++i) {
    if (far.centers.size() < kCountryQueries && is_far(all.centers[i])) far.centers.push_back(all.centers[i]);
    if (far.rays.size() < kCountryQueries && is_far(all.rays[i].origin)) far.rays.push_back(all.rays[i]);
  }
  return far;
}

void ask_country(Contender& contender, Task task, const Queries& queries, Answers& answers) {
  answers.clear();
  if (task == Task::kBall) contender.balls(queries.centers, answers);
  if (task == Task::kBox) contender.boxes(queries.centers, answers);
  if (task == Task::kRay) contender.rays(queries.rays, answers);
  if (task == Task::kNearest) contender.nearest(queries.centers, answers);
}

void run_country(const Options& options, Kind kind, uint32_t count, Report& report) {
  World world(kind, count);
  Country country(world);
  Ours crowded, sparse;
  const int64_t before = heap_bytes();
  crowded.load(world.objects());
  int64_t bytes = heap_bytes() - before;
  sparse.load(country.objects());
  for (size_t tick = 0; tick < kTicksBefore; ++tick) {
    world.step();
    country.gather(world);
    const int64_t before_tick = heap_bytes();
    crowded.move(world.moves());
    crowded.forget_past();
    bytes += heap_bytes() - before_tick;
    sparse.move(country.moves());
    sparse.forget_past();
  }
  const Queries queries = country_queries(world);
  const auto crowded_batches = batches_of(crowded, {}, kCountryReach);
  const auto sparse_batches = batches_of(sparse, {}, kCountryReach);
  for (const CountryCase& one : kCountryCases) {
    const std::string name = country_case(one.name, world);
    if (!options.filter.wants(name)) continue;
    Answers ours, theirs;
    ask_country(*crowded_batches, one.task, queries, ours);
    ask_country(*sparse_batches, one.task, queries, theirs);
    if (ours.ids != theirs.ids || ours.distances != theirs.distances)
      report.disagreements.push_back(name + ": the rows differ from those of the scene without the hub");
    const auto contestant = [&](const std::string& who, Contender& contender) {
      const auto turn = [&contender, &queries, task = one.task, answers = Answers()](size_t) mutable {
        for (int pass = 0; pass < 5; ++pass) ask_country(contender, task, queries, answers);
      };
      return Contestant{who, turn, 5.0 * kCountryQueries, {}};
    };
    const std::vector<Contestant> contestants = {contestant("locus", *crowded_batches),
                                                 contestant("uniform", *sparse_batches)};
    const auto times = race(contestants, 1, options.rounds, thread_seconds);
    add_cells(contestants, times, cell_of(name, "ns/query", hash_of(ours)), report);
  }
  const std::string name = country_case("country/memory", world);
  if (!options.filter.wants(name)) return;
  World uniform(Kind::kUniform, count);
  Ours even;
  const int64_t before_even = heap_bytes();
  even.load(uniform.objects());
  for (size_t tick = 0; tick < kTicksBefore; ++tick) {
    uniform.step();
    even.move(uniform.moves());
    even.forget_past();
  }
  Cell cell = cell_of(name, "bytes/object", hash_of_number(count));
  cell.ours = static_cast<double>(bytes) / count;
  cell.peer = static_cast<double>(heap_bytes() - before_even) / count;
  cell.peer_name = "uniform";
  cell.ratio = cell.peer / cell.ours;
  report.add(cell);
}

}  // namespace

void run_country_cases(const Options& options, const Progress& progress, Report& report) {
  for (const Kind kind : kHubs) {
    for (const uint32_t count : {10'000u, 100'000u, 1'000'000u}) {
      const std::string world = absl::StrCat(name_of(kind), "/", name_of_count(count));
      const bool usual = count == (options.quick ? 10'000u : 100'000u);
      if (options.quick ? !usual : options.filter.wants_every() && !usual) continue;
      const auto wants = [&](const char* name) { return options.filter.wants(absl::StrCat(name, "/", world)); };
      const bool wants_query = std::any_of(kCountryCases.begin(), kCountryCases.end(),
                                           [&](const CountryCase& one) { return wants(one.name); });
      if (!wants_query && !wants("country/memory")) continue;
      progress("country/" + world);
      run_country(options, kind, count, report);
    }
  }
}

}  // namespace locus::bench::dynamic
