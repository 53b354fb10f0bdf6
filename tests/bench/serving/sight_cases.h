// Case sight/100x100x3: a matrix of sight over the network, compared with the same segments as rays of mode ANY in one
// batch.
#ifndef LOCUS_TESTS_BENCH_SERVING_SIGHT_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_SIGHT_CASES_H_

#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs the case if the options want it. Returns an error if the server does not start, refuses the
// level, or fails a query.
absl::Status run_sight_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_SIGHT_CASES_H_
