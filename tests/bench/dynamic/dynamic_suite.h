// The suite `dynamic`: moving objects, in locus and in each peer. Used by main.cc.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_DYNAMIC_SUITE_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_DYNAMIC_SUITE_H_

#include "absl/status/status.h"
#include "tests/bench/frame/suite.h"

namespace locus::bench::dynamic {

absl::Status run_dynamic_suite(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_DYNAMIC_SUITE_H_
