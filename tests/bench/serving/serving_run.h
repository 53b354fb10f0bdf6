// Data that the cases of the suite share (the options and the report), and helpers that add cells. Plain data.
#ifndef LOCUS_TESTS_BENCH_SERVING_SERVING_RUN_H_
#define LOCUS_TESTS_BENCH_SERVING_SERVING_RUN_H_

#include <algorithm>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/cell.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/frame/statistics.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench::serving {

struct ServingRun {
  const Options& options;
  const Progress& progress;
  Report& report;

  bool wants(const std::string& name) const { return options.filter.wants(name); }
  void note(const std::string& sentence) const { report.notes.push_back(sentence); }
  void disagree(const std::string& sentence) const { report.disagreements.push_back(sentence); }
};

inline Cell cell_of(const std::string& case_name, const std::string& metric, const std::string& results_hash) {
  Cell cell;
  cell.suite = "serving";
  cell.case_name = case_name;
  cell.metric = metric;
  cell.results_hash = results_hash;
  return cell;
}

// Direction of a comparison: kMore if a higher value is better, as for rates; kLess if a lower value is better, as for
// times.
enum class Better : uint8_t { kLess, kMore };
inline void add_cell(const ServingRun& run, Cell cell, const std::string& peer, const std::vector<double>& ours,
                     const std::vector<double>& theirs, Better better) {
  const std::vector<double> ratios = better == Better::kMore ? round_ratios(theirs, ours) : round_ratios(ours, theirs);
  cell.peer_name = peer;
  cell.ours = median(ours);
  cell.peer = median(theirs);
  cell.ratio = median(ratios);
  cell.spread = spread(ratios);
  run.report.add(std::move(cell));
}

// Returns the number of passes, at most 100, that together take about 0.1 s, so that the time of starting threads and
// filling windows does not matter. Calls `pass` once to measure it; in a quick run returns 1.
template <class Run>
size_t passes_of_a_chunk(const ServingRun& run, const Run& pass) {
  if (run.options.quick) return 1;
  constexpr double kChunkSeconds = 0.1;
  constexpr double kMaxPasses = 100;
  const double start = wall_seconds();
  pass(size_t{1});
  return static_cast<size_t>(std::clamp(kChunkSeconds / (wall_seconds() - start), 1.0, kMaxPasses));
}

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_SERVING_RUN_H_
