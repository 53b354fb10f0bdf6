// The suite `log`: time to bring update batches to the disk. The cases are listed in tests/bench/README.md.
#ifndef LOCUS_TESTS_BENCH_LOG_LOG_SUITE_H_
#define LOCUS_TESTS_BENCH_LOG_LOG_SUITE_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::log {

// Runs the suite; returns an error if files cannot be written.
absl::Status run_log_suite(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_LOG_SUITE_H_
