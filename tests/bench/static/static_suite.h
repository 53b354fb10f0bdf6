// The suite `static`: one level, never changed, asked by one thread as fast as it goes; us beside the libraries that
// are best at it. Cases and workloads: README.md.
#ifndef LOCUS_TESTS_BENCH_STATIC_STATIC_SUITE_H_
#define LOCUS_TESTS_BENCH_STATIC_STATIC_SUITE_H_

#include "absl/status/status.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench {

// Errors: those of load_mesh() for a mesh that was asked for by name. Fetched levels that are absent are only noted.
absl::Status run_static_suite(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_STATIC_SUITE_H_
