// What it costs that acks wait for the disk, and how soon a killed daemon answers again. For the suite serving.
#ifndef LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// durable/256, durable_queries/256: moves over one stream, and queries beside such a stream, where acks wait for the
// disk and where they do not, on one daemon by turns. restart/1M: seconds from the start of a daemon that was killed to
// its first answer, which has to be the right one, beside the second that it may take.
absl::Status run_durable_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_DURABLE_CASES_H_
