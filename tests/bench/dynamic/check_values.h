// Expected results of the workload, computed by other programs from the same definition: sums of all answers over
// kQueries queries. A pure function.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_

#include <string>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench::dynamic {

// Returns the number of ticks from the start of a world to its queries.
uint32_t ticks_before_queries(uint32_t count);

// Reports sums that differ from the known ones for this world after that many ticks. Accepts worlds without known
// values.
void check_values(const std::string& case_name, Task task, const World& world, const Queries& queries,
                  const std::string& contender, const Answers& answers, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_CHECK_VALUES_H_
