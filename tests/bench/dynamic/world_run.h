// What the cases of one world share: who is asked, and where results go. Plain data and pure functions.
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

struct WorldRun {
  const Options& options;
  const Progress& progress;
  World& world;
  const Queries& queries;  // about its start
  Ours& ours;
  const std::vector<std::unique_ptr<Contender>>& peers;  // loaded, and moved as the world was
  Report& report;

  std::string case_of(const std::string& what) const { return absl::StrCat(what, "/", world.name()); }
};

// The part of a cell that a case knows.
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
