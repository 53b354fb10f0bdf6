// Comparison of a peer's answers with those of locus. If they differ, a test of every object by the predicates of
// core/geometry decides which are right. Those of locus must always be right. A peer decides in float and may differ in
// a few queries, which is noted; more is a disagreement. Writes into a report; pure otherwise.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_

#include <string>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench::dynamic {

// Tolerated share of differing queries: one in kDifferingQueries, at least one query.
inline constexpr size_t kDifferingQueries = 20;
inline constexpr size_t kDifferingQueriesOf = 10'000;
// Distances along rays, and to nearest objects, count as different if their difference exceeds this.
inline constexpr float kSameDistance = 0.02f;
inline constexpr float kSameNearDistance = 0.001f;

// Compares two sets of answers, both to all of `queries`, in their order.
void compare(const std::string& case_name, Task task, const World& world, const Queries& queries, const Answers& ours,
             const std::string& peer, const Answers& theirs, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_
