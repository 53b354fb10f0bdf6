// What the line of `locus-bench` asks for. For main.cc, which fills it, and for every suite, which reads it. Plain
// data.
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
  std::string json;                 // a file to write; empty = none
  bool quick = false;               // every case in small
  CaseFilter filter;                // the cases to run
  int rounds = kMinRounds;          // counted ones
  std::vector<std::string> meshes;  // in place of the suite's own
  int threads = 2;                  // of the cases that use several
  std::string levels;               // where fetched levels are kept
};

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_OPTIONS_H_
