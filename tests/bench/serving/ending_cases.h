// Time until the server stops work whose result no caller waits for: after a deadline, after a cancellation. For the
// suite serving.
#ifndef LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

bool wants_ending(const ServingRun& run);

// Runs deadline/1ms and cancel/1000: milliseconds that the server still computes, compared with the complete job.
absl::Status run_ending_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_
