// The cases of queries about one world. ball, box, ray and nearest use locus's index without the query engine;
// ball_batch, box_batch, ray_batch and nearest_batch use whole batches. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

// Returns a hash of the answers, independent of the order of the ids within a query.
std::string hash_of(const Answers& answers);

// Verifies that all contenders find the same objects in some balls of the present world, which shows that updates moved
// the objects to the right positions. Returns the hash of locus's answers.
std::string compare_some_balls(const WorldRun& run, const std::string& case_name);

void run_query_cases(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_
