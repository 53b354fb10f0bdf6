// Cost of messages without the work of queries and updates: columns to the server and back, rays that hit nothing, and
// duplicate moves, which are not applied again. These messages are compared with the same number of bytes over plain
// sockets. Moves that are applied are compared with moves in this process. Used by the suite serving.
#ifndef LOCUS_TESTS_BENCH_SERVING_ECHO_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_ECHO_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/raw_tcp.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

bool wants_raw_tcp(const ServingRun& run);

// Runs echo/1024, echo/8192, empty/1024, empty/8192, moves/256, moves/4096, moves_applied/256, moves_applied/4096.
absl::Status run_echo_cases(const ServingRun& run, const RawTcpServer& plain);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_ECHO_CASES_H_
