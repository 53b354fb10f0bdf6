// The case scan/1024: the time to scan a message before it is parsed, compared with the time to check and answer the
// queries in the message.
#ifndef LOCUS_TESTS_BENCH_SERVING_SCAN_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_SCAN_CASES_H_

#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs the case if the filter selects it. Returns the error of a server that did not start or refused the level.
absl::Status run_scan_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_SCAN_CASES_H_
