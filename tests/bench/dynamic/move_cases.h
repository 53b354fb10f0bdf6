// The case move of one world: whole ticks by ids of the caller's choice, through our scene's writer. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

// Moves the world on, and all contenders with it.
void run_move_case(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_
