#include "tests/bench/dynamic/dynamic_suite.h"

#include <algorithm>

#include "tests/bench/dynamic/check_values.h"
#include "tests/bench/dynamic/compound_cases.h"
#include "tests/bench/dynamic/concurrent_cases.h"
#include "tests/bench/dynamic/country_cases.h"
#include "tests/bench/dynamic/growth_case.h"
#include "tests/bench/dynamic/insert_cases.h"
#include "tests/bench/dynamic/instance_cases.h"
#include "tests/bench/dynamic/move_cases.h"
#include "tests/bench/dynamic/peers.h"
#include "tests/bench/dynamic/query_cases.h"
#include "tests/bench/dynamic/rewind_cases.h"
#include "tests/bench/frame/heap.h"
#include "tests/bench/frame/peer_library.h"

namespace locus::bench::dynamic {
namespace {

constexpr uint32_t kCounts[] = {10'000, 100'000, 1'000'000};
// Cases that run once for each world.
constexpr const char* kCases[] = {"memory",    "ball",      "box",           "ray",  "nearest", "ball_batch",
                                  "box_batch", "ray_batch", "nearest_batch", "move", "insert",  "reinsert"};

// Returns whether a world is in the default set, which runs if there is no filter.
bool is_usual(Kind kind, uint32_t count) {
  if (kind == Kind::kOneCell) return count == 10'000;
  if (kind == Kind::kUniform) return true;
  return count == 100'000 || (kind == Kind::kClustered && count == 1'000'000);
}

// Returns the number of queries about a world. A world of one cell gets fewer, since each of its queries finds all
// objects.
size_t query_count(Kind kind, uint32_t count, const Options& options) {
  if (kind == Kind::kOneCell) return std::max(20u, 2'000'000 / count);
  return options.quick && kind != Kind::kUniform ? kQueries / 10 : kQueries;
}

bool wants_any(const Options& options, const std::string& world) {
  return std::any_of(std::begin(kCases), std::end(kCases),
                     [&](const char* name) { return options.filter.wants(absl::StrCat(name, "/", world)); });
}

// Runs `work` and adds to `bytes` the heap bytes that `work` allocates and does not free.
template <class Work>
void weigh(int64_t& bytes, const Work& work) {
  const int64_t before = heap_bytes();
  work();
  bytes += heap_bytes() - before;
}

std::vector<Entrant> all_entrants(const World& world) {
  std::vector<Entrant> entrants;
  for (const Maker& maker : makers_for(world)) {
    Entrant& entrant = entrants.emplace_back();
    weigh(entrant.bytes, [&] {
      entrant.contender = maker.make();
      entrant.contender->load(world.objects());
    });
  }
  return entrants;
}

void tick(World& world, std::vector<Entrant>& entrants) {
  world.step();
  for (Entrant& entrant : entrants) {
    weigh(entrant.bytes, [&] {
      entrant.contender->move(world.moves());
      entrant.contender->forget_past();
    });
  }
}

void run_world(const Options& options, World& world, Report& report) {
  const Queries queries = queries_of(world, query_count(world.kind(), world.count(), options));
  std::vector<Entrant> entrants = all_entrants(world);
  for (uint32_t i = 0; i < ticks_before_queries(world.count()); ++i) tick(world, entrants);
  const auto& ours = dynamic_cast<const Ours&>(*entrants.front().contender);
  const WorldRun run{options, world, queries, entrants, ours, report};
  run_memory_case(run);
  run_query_cases(run);
  run_move_case(run);
  run_reinsert_case(run);
  run_insert_case(run);
}

}  // namespace

absl::Status run_dynamic_suite(const Options& options, const Progress& progress, Report& report) {
  report.notes = missing_peers({kBullet, kBoost, kNanoflann});
  report.notes.emplace_back("worlds of several sizes: boost_rtree, nanoflann and flat_hash_map support only one size");
  for (const Kind kind : kKinds) {
    for (const uint32_t count : kCounts) {
      if (options.quick && count != kCounts[0]) continue;
      const std::string name = absl::StrCat(name_of(kind), "/", name_of_count(count));
      const bool usual = options.quick || is_usual(kind, count);
      if (!wants_any(options, name) || (options.filter.wants_every() && !usual)) continue;
      progress(name);
      World world(kind, count);
      run_world(options, world, report);
    }
  }
  run_country_cases(options, progress, report);
  run_growth_case(options, progress, report);
  run_rewind_cases(options, progress, report);
  run_instance_cases(options, progress, report);
  run_compound_cases(options, progress, report);
  run_concurrent_cases(options, progress, report);
  return absl::OkStatus();
}

}  // namespace locus::bench::dynamic
