// The suite `queries`: sweeps, sight, contains, cells, nearest, capsules, counts, pairs and frustums. The queries run
// as whole batches through the query engine. They are compared with libraries that answer one query at a time, or with
// another way of querying locus. One thread.
#ifndef LOCUS_TESTS_BENCH_QUERIES_QUERIES_SUITE_H_
#define LOCUS_TESTS_BENCH_QUERIES_QUERIES_SUITE_H_

#include "absl/status/status.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench::queries {

// Runs the suite. Returns the error of load_mesh() for a mesh named in the options.
absl::Status run_queries_suite(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_QUERIES_SUITE_H_
