// Cases that measure the effects of one client on another, and of a flood of calls on the server. They measure small
// batches while another client sends large batches, a server that gets more calls than it admits, clients that do not
// read or that reconnect, and expired and cancelled calls. Used by the benchmark suite `serving`.
#ifndef LOCUS_TESTS_BENCH_SERVING_CROWD_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_CROWD_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs mixed_p50/16, mixed_p99/16, overload/10x/at_once, overload/10x/as_told, and the cases of guest_cases.h and
// ending_cases.h.
absl::Status run_crowd_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_CROWD_CASES_H_
