// Comparison of a peer's answers with those of locus. If they differ, a test of every object by the predicates of
// core/geometry decides which answers are right. The answers of locus must always be right. Peers compute in float, so
// differences in a few queries are only noted; differences in more queries are a disagreement. Writes into a report;
// pure otherwise.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_

#include <string>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench::dynamic {

// A peer may answer at most kDifferingQueries of kDifferingQueriesOf queries differently. One differing query is always
// tolerated.
inline constexpr size_t kDifferingQueries = 20;
inline constexpr size_t kDifferingQueriesOf = 10'000;
// Two distances count as different if they differ by more than kSameDistance (along a ray) or kSameNearDistance (to a
// nearest object).
inline constexpr float kSameDistance = 0.02f;
inline constexpr float kSameNearDistance = 0.001f;

// Compares the answers of locus and of a peer. Both have an answer for each of `queries`, in the order of `queries`.
void compare(const std::string& case_name, Task task, const World& world, const Queries& queries, const Answers& ours,
             const std::string& peer, const Answers& theirs, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_
