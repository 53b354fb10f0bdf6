// What the workload must give, from other programs of the same definition: sums over kQueries queries of all answers. A
// pure function.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_

#include <string>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench::dynamic {

// Ticks from the start of a world to its queries.
uint32_t ticks_before_queries(uint32_t count);

// Reports sums that are not those known for this world, which has gone that many ticks. Worlds without known values
// pass.
void check_values(const std::string& case_name, Task task, const World& world, const Queries& queries,
                  const std::string& contender, const Answers& answers, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_
