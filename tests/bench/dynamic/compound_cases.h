// The cases of compounds: moves, rotations and new part poses of 10,000 bodies of 16 balls, compared with moves of as
// many balls; and rays and balls in a scene of these bodies, compared with a scene in which every part is an object.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_COMPOUND_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_COMPOUND_CASES_H_

#include "tests/bench/frame/suite.h"

namespace locus::bench::dynamic {

void run_compound_cases(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_COMPOUND_CASES_H_
