// The cases of instances: changes/KIND, the time of moving, placing and removing one of 100,000 instances, or one in a
// hundred, compared with placing all; and doors/1reader, ticks in a second of a scene in which 2,000 instances and
// 10,000 objects move at each tick while a thread casts rays, compared with the 30 that are required.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_INSTANCE_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_INSTANCE_CASES_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::dynamic {

void run_instance_cases(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_INSTANCE_CASES_H_
