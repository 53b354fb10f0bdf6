// The cases ball, box and ray of one world, by our index alone, and ball_batch, box_batch and ray_batch by whole
// batches. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_

#include "tests/bench/dynamic/world_run.h"

namespace locus::bench::dynamic {

// Asks all of these queries in so many calls: a call is a batch to those who take batches.
inline constexpr size_t kParts = 10;
void ask_all(Contender& contender, Task task, const Queries& queries, Answers& answers);

// A hash of the answers, whatever the order within a query.
std::string hash_of(const Answers& answers);

void run_query_cases(const WorldRun& run);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_QUERY_CASES_H_
