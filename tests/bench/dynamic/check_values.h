// Verification of the workload's results: their sums over kQueries queries must equal sums that other programs computed
// from the same definition of the workload. Writes into a report; pure otherwise.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_

#include <string>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench::dynamic {

// Returns the number of ticks by which a world of `count` objects is advanced before it is queried.
uint32_t ticks_before_queries(uint32_t count);

// Reports each sum that differs from the expected sum. `world` must have been advanced by ticks_before_queries() ticks.
// Reports nothing if no sums are known for this world or number of queries.
void check_values(const std::string& case_name, Task task, const World& world, const Queries& queries,
                  const std::string& contender, const Answers& answers, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_
