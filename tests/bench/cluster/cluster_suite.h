// The suite `cluster`: appends to a replicated PostgreSQL. README.md in this folder lists the cases.
#ifndef LOCUS_TESTS_BENCH_CLUSTER_CLUSTER_SUITE_H_
#define LOCUS_TESTS_BENCH_CLUSTER_CLUSTER_SUITE_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::cluster {

// Runs the suite. Reports a missing PostgreSQL as a missing peer; returns an error if the engine fails.
absl::Status run_cluster_suite(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::cluster

#endif  // LOCUS_TESTS_BENCH_CLUSTER_CLUSTER_SUITE_H_
