// The cases ball, box, ray and nearest of one world, by our index alone, and the same with _batch by whole batches. One
// thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

// Of the answers, whatever the order within a query.
std::string hash_of(const Answers& answers);

// Whether all contenders find the same in some balls about the world of now: the objects are where they should be. The
// hash of our answers.
std::string compare_some_balls(const WorldRun& run, const std::string& case_name);

void run_query_cases(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_
