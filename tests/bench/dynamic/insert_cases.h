// Three cases of one world. One thread.
//   insert    all objects are inserted into an empty structure
//   reinsert  a tenth of the objects, drawn with seed 9, is removed, then inserted again
//   memory    bytes of a structure with one live revision, after ticks_before_queries() ticks; they include the map of
//             ids if the structure needs one
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_INSERT_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_INSERT_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

void run_insert_case(const WorldRun& run);
void run_reinsert_case(const WorldRun& run);
void run_memory_case(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_INSERT_CASES_H_
