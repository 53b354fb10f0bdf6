// Processor time that the server spends on a call whose caller no longer waits, because the deadline has passed or the
// call was cancelled. Used by the benchmark suite `serving`.
#ifndef LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

bool wants_ending(const ServingRun& run);

// Runs deadline/1ms and cancel/1000: milliseconds of processor time that the server uses after the end of the call,
// compared with those of the complete job.
absl::Status run_ending_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_ENDING_CASES_H_
