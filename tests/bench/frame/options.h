// Options of the command line of `locus-bench`. main.cc fills them, every suite reads them. Plain data.
#ifndef LOCUS_TESTS_BENCH_FRAME_OPTIONS_H_
#define LOCUS_TESTS_BENCH_FRAME_OPTIONS_H_

#include <string>
#include <vector>

#include "tests/bench/frame/case_filter.h"

namespace locus::bench {

inline constexpr int kMinRounds = 3;
inline constexpr int kMaxRounds = 1000;
inline constexpr int kMaxThreads = 256;

struct Options {
  std::string suite;
  std::string json;                 // path of the JSON output file; empty = no JSON
  bool quick = false;               // runs every case with a small workload
  CaseFilter filter;                // cases to run
  int rounds = kMinRounds;          // number of measured rounds; the warm-up round is not counted
  std::vector<std::string> meshes;  // meshes to use instead of the suite's default ones; empty = default
  int threads = 2;                  // number of threads in the case threads2, whose name contains this number
  std::string levels;               // folder where fetch_levels.sh stored levels
};

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_OPTIONS_H_
