// The cases insert (all objects into an empty structure) and reinsert (a tenth of them, drawn with seed 9: all removed,
// then inserted again) of one world, and memory (bytes of a structure, including everything that a caller of ids needs,
// after the ticks before the queries, with one live revision). One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_INSERT_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_INSERT_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

void run_insert_case(const WorldRun& run);
void run_reinsert_case(const WorldRun& run);
void run_memory_case(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_INSERT_CASES_H_
