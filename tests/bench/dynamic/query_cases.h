// The cases ball, box, ray and nearest of one world, by locus's index alone, and those with _batch by whole batches.
// One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

// Returns a hash of the answers that is independent of the order within a query.
std::string hash_of(const Answers& answers);

// Verifies that all contenders find the same objects in some balls about the present world, so that objects are where
// they should be. Returns the hash of locus's answers.
std::string compare_some_balls(const WorldRun& run, const std::string& case_name);

void run_query_cases(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_
