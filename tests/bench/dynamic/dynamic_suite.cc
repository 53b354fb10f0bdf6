#include "tests/bench/dynamic/dynamic_suite.h"

#include <algorithm>

#include "tests/bench/dynamic/check_values.h"
#include "tests/bench/dynamic/move_cases.h"
#include "tests/bench/dynamic/peers.h"
#include "tests/bench/dynamic/query_cases.h"

namespace locus::bench::dynamic {
namespace {

constexpr uint32_t kCounts[] = {10'000, 100'000, 1'000'000};

// What runs without a filter.
bool is_usual(Kind kind, uint32_t count, const Options& options) {
  if (options.quick || kind == Kind::kOneCell) return count == 10'000;
  if (kind == Kind::kUniform) return true;
  return count == 100'000 || (kind == Kind::kClustered && count == 1'000'000);
}

// In one cell, everything finds everything.
size_t query_count(Kind kind, uint32_t count) {
  return kind == Kind::kOneCell ? std::max(20u, 2'000'000 / count) : kQueries;
}

bool wants_any(const Options& options, const std::string& world) {
  constexpr const char* kCases[] = {"move", "ball", "box", "ray", "ball_batch", "box_batch", "ray_batch"};
  return std::any_of(std::begin(kCases), std::end(kCases),
                     [&](const char* name) { return options.filter.wants(absl::StrCat(name, "/", world)); });
}

void run_world(const Options& options, const Progress& progress, World& world, Report& report) {
  Ours ours;
  ours.load(world.objects());
  std::vector<std::unique_ptr<Contender>> peers;
  for (const Maker& maker : peer_makers()) {
    if (maker.one_size_only && !has_one_size(world.kind())) {
      report.notes.push_back(absl::StrCat(world.name(), ": ", maker.name, " is left out: it takes one size only"));
      continue;
    }
    peers.push_back(maker.make());
    peers.back()->load(world.objects());
  }
  const Queries queries = queries_of(world, query_count(world.kind(), world.count()));
  for (uint32_t tick = 0; tick < ticks_before_queries(world.count()); ++tick) {
    world.step();
    ours.move(world.moves());
    for (const auto& peer : peers) peer->move(world.moves());
  }
  const WorldRun run{options, progress, world, queries, ours, peers, report};
  run_query_cases(run);
  run_move_case(run);
}

}  // namespace

absl::Status run_dynamic_suite(const Options& options, const Progress& progress, Report& report) {
  report.notes = missing_peers();
  for (const Kind kind : kKinds) {
    for (const uint32_t count : kCounts) {
      const std::string name = absl::StrCat(name_of(kind), "/", name_of_count(count));
      if (!wants_any(options, name) || (options.filter.wants_every() && !is_usual(kind, count, options))) continue;
      progress(name);
      World world(kind, count);
      run_world(options, progress, world, report);
    }
  }
  return absl::OkStatus();
}

}  // namespace locus::bench::dynamic
