// Whether a peer's answers and ours are the same, and who is right where they are not: that is decided by asking every
// object with the predicates of core/geometry. Ours have to be right everywhere. A peer decides in float and may differ
// in a few queries, which is noted; more is a disagreement. Writes into a report; pure otherwise.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_

#include <string>

#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/cell.h"

namespace locus::bench::dynamic {

// At most so many queries in so many, at least one.
inline constexpr size_t kDifferingQueries = 20;
inline constexpr size_t kDifferingQueriesOf = 10'000;
// Distances differ where they are further apart than this: along rays, and to what is nearest.
inline constexpr float kSameDistance = 0.02f;
inline constexpr float kSameNearDistance = 0.001f;

// Both answer all of `queries`, in their order.
void compare(const std::string& case_name, Task task, const World& world, const Queries& queries, const Answers& ours,
             const std::string& peer, const Answers& theirs, Report& report);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_AGREEMENT_H_
