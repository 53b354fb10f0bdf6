// Cost of acks that wait for the disk, and the time until a daemon that was killed answers again. Used by the benchmark
// suite `serving`.
#ifndef LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs durable/256 (moves over one stream) and durable_queries/256 (queries while such a stream runs). Both are
// measured with acks that wait for the disk and with acks that do not, in turns, on one daemon. Runs restart/1M: a
// killed daemon is started again, and the seconds from this start to the daemon's first right answer are compared with
// a required maximum of one second.
absl::Status run_durable_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_
