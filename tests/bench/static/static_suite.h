// The suite `static`: queries of one immutable level by one thread at full speed, in locus and in the best libraries
// for this task. Cases and workloads: README.md.
#ifndef LOCUS_TESTS_BENCH_STATIC_STATIC_SUITE_H_
#define LOCUS_TESTS_BENCH_STATIC_STATIC_SUITE_H_

#include "absl/status/status.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench {

// Runs the suite. Returns the error of load_mesh() for a mesh named in the options. Levels that were not fetched are
// only noted.
absl::Status run_static_suite(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_STATIC_SUITE_H_
