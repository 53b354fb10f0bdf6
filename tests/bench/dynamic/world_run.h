// Data that the cases of one world share: the world, its queries, the contenders, and the report. Plain data.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_WORLD_RUN_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_WORLD_RUN_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/bench/dynamic/ours.h"
#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/cell.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench::dynamic {

struct Entrant {
  std::unique_ptr<Contender> contender;
  int64_t bytes = 0;  // heap bytes that the contender uses after loading and moves
};

struct WorldRun {
  const Options& options;
  World& world;
  const Queries& queries;                // made from the world before its first tick
  const std::vector<Entrant>& entrants;  // contenders, loaded and moved like the world; the first is locus
  const Ours& ours;                      // the first entrant
  Report& report;

  std::string case_of(const std::string& what) const { return absl::StrCat(what, "/", world.name()); }
};

// Returns the factories of locus and of all peers that support the radii of this world.
std::vector<Maker> makers_for(const World& world);

// Returns a cell of the suite `dynamic` without results.
inline Cell cell_of(const std::string& case_name, const std::string& metric, const std::string& results_hash) {
  Cell cell;
  cell.suite = "dynamic";
  cell.case_name = case_name;
  cell.metric = metric;
  cell.results_hash = results_hash;
  return cell;
}

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_WORLD_RUN_H_
