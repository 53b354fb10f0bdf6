// The cost of TLS: the same queries to two daemons, one of which serves TLS, and new connections to them. Used by the
// suite serving.
#ifndef LOCUS_TESTS_BENCH_SERVING_TLS_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_TLS_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs tls/8192, tls/16, tls/handshake, tls/mutual_handshake.
absl::Status run_tls_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_TLS_CASES_H_
