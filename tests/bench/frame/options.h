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
  std::string json;                 // output file; empty = none
  bool quick = false;               // runs every case with a small workload
  CaseFilter filter;                // cases to run
  int rounds = kMinRounds;          // without the warm-up round
  std::vector<std::string> meshes;  // replaces the suite's own
  int threads = 2;                  // threads of the cases that use several
  std::string levels;               // folder of fetched levels
};

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_OPTIONS_H_
