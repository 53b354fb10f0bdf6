// The suite tuning: what `locus tune` names and promises, compared with a sweep over all cell sizes and with the times
// of a scene in which the named size was set. It starts the programs locusd and locus.
#ifndef LOCUS_TESTS_BENCH_TUNING_TUNING_SUITE_H_
#define LOCUS_TESTS_BENCH_TUNING_TUNING_SUITE_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::tuning {

// Returns UNAVAILABLE if there is no program `locus` or `locusd` beside this one.
absl::Status run_tuning_suite(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::tuning

#endif  // LOCUS_TESTS_BENCH_TUNING_TUNING_SUITE_H_
