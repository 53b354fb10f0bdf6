// The case move of one world: whole ticks by ids that the caller chooses, through the scene's writer of locus. One
// thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

// Advances the world and all contenders.
void run_move_case(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_
