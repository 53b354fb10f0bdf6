// Cost of acks that wait for the disk, and the time until a killed daemon answers again. For the suite serving.
#ifndef LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs durable/256, durable_queries/256: moves over one stream, and queries beside such a stream, with acks that wait
// for the disk and acks that do not, on one daemon in turns. Runs restart/1M: seconds from the start of a daemon that
// was killed to its first answer, which must be right, compared with the bar of one second.
absl::Status run_durable_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_
