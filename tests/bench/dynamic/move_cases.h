// The case move of one world: moves of all objects, tick by tick, by ids that the caller chooses. In locus the scene's
// writer applies them. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

// Measures the case. Advances the world, and moves the objects in all contenders.
void run_move_case(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_MOVE_CASES_H_
