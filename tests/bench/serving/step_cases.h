// Cases step/shooter_unary and step/shooter_stream: the tick of a shooter, its moves and its queries, as one step,
// compared with an update and then a query that sees it.
#ifndef LOCUS_TESTS_BENCH_SERVING_STEP_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_STEP_CASES_H_

#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs the cases that the options want. Returns an error if the server does not start, or refuses an update or a query.
absl::Status run_step_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_STEP_CASES_H_
