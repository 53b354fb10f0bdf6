// The cases rewind/1tick, 10ticks and 30ticks: batches of balls about the past of a uniform world, half-way between two
// ticks, compared with the same balls about the present. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_REWIND_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_REWIND_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

// Runs the cases. The case with a million objects runs only if a filter selects it, because its history takes
// gigabytes.
void run_rewind_cases(const Options& options, const Progress& progress, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_REWIND_CASES_H_
