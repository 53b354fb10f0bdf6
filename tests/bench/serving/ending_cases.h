// How soon work ends that nobody waits for any more: after a deadline, after callers cancelled. For the suite serving.
#ifndef LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

bool wants_ending(const ServingRun& run);

// deadline/1ms, cancel/1000: milliseconds of computing that the server goes on with, beside the whole job.
absl::Status run_ending_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_
