// The suite `serving`: a server and its client as two processes on the loopback, compared with the same work in this
// process, with plain sockets and with Redis. Used by main.cc.
#ifndef LOCUS_TESTS_BENCH_SERVING_SERVING_SUITE_H_
#define LOCUS_TESTS_BENCH_SERVING_SERVING_SUITE_H_

#include "absl/status/status.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench::serving {

// Runs the cases, which start the locusd in the folder of this program. Returns UNAVAILABLE if it is missing.
absl::Status run_serving_suite(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_SERVING_SUITE_H_
