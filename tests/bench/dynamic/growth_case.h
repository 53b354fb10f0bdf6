// The case growth/ball: time of a ball query of locus among many objects, compared with its time among few objects at
// the same density. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_GROWTH_CASE_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_GROWTH_CASE_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::dynamic {

void run_growth_case(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_GROWTH_CASE_H_
