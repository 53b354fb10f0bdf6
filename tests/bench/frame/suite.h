// A suite of benchmarks: a folder of its own with one function, and one line in main.cc. Plain data.
#ifndef LOCUS_TESTS_BENCH_FRAME_SUITE_H_
#define LOCUS_TESTS_BENCH_FRAME_SUITE_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "tests/bench/frame/cell.h"
#include "tests/bench/frame/options.h"

namespace locus::bench {

// Function that shows a sentence as the phase of the progress.
using Progress = std::function<void(const std::string& sentence)>;

struct Suite {
  std::string name;
  std::string description;
  // Runs the cases and adds the results of each to the report. Returns an error if the suite cannot run at all, for
  // example if a mesh cannot be read.
  absl::Status (*run)(const Options& options, const Progress& progress, Report& report);
};

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_SUITE_H_
