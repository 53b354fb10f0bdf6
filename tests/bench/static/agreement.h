// Comparison of a peer's answers with those of locus. If they differ, a test of every triangle by the predicates of
// core/geometry decides which answers are right. The answers of locus must always be right. A peer's differences are
// noted if they are within the limits below, or if the peer has a known fault; otherwise they are a disagreement.
// Writes into a report; pure otherwise.
#ifndef LOCUS_TESTS_BENCH_STATIC_AGREEMENT_H_
#define LOCUS_TESTS_BENCH_STATIC_AGREEMENT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "tests/bench/frame/cell.h"
#include "tests/bench/static/mesh_run.h"
#include "tests/bench/static/peer.h"

namespace locus::bench {

// Tolerance: two answers to a ray differ if only one of them is a hit, or if the difference of their t exceeds this
// part of the mesh's diagonal.
inline constexpr double kSameHit = 1e-4;
// Tolerated differences of a peer: kDifferingRays in kDifferingRaysOf rays, since a ray can graze a silhouette, and the
// part kDifferingIds of all ids, since float tests round.
inline constexpr size_t kDifferingRays = 20;
inline constexpr size_t kDifferingRaysOf = 500'000;
inline constexpr double kDifferingIds = 1e-3;

// Compares first hits. `ours` has the answers to all rays of a case, `theirs` the answers to the rays in `asked`, the
// subset that was given to the peer.
void compare_first(const std::string& case_name, const BenchMesh& mesh, const Peer& peer, Task task,
                   const Asked<RayQuery>& asked, absl::Span<const RayAnswer> ours, absl::Span<const RayAnswer> theirs,
                   Report& report);
void compare_any(const std::string& case_name, const BenchMesh& mesh, const Peer& peer, const Asked<RayQuery>& asked,
                 absl::Span<const uint8_t> ours, absl::Span<const uint8_t> theirs, Report& report);

// Differences between a peer and locus in all queries of a case.
struct RegionTally {
  size_t queries = 0;            // differing queries
  size_t ids = 0;                // differing ids
  size_t all_ids = 0;            // ids that locus found in all queries
  std::string first_difference;  // a sentence; empty if there is none
};
// Compares the ids of one query, which may be in any order. `overlaps(id)` tests by core/geometry whether the query
// reaches triangle `id`. Adds differences to the tally, and reports an error of locus at once.
template <class Overlaps>
void compare_ids(const std::string& where, std::vector<uint32_t> ours, std::vector<uint32_t> theirs, Overlaps overlaps,
                 RegionTally& tally, Report& report);

// Reports the tally after the last query.
void report_tally(const std::string& case_name, const Peer& peer, Task task, const RegionTally& tally, Report& report);

template <class Overlaps>
void compare_ids(const std::string& where, std::vector<uint32_t> ours, std::vector<uint32_t> theirs, Overlaps overlaps,
                 RegionTally& tally, Report& report) {
  std::sort(ours.begin(), ours.end());
  std::sort(theirs.begin(), theirs.end());
  if (std::adjacent_find(ours.begin(), ours.end()) != ours.end())
    report.disagreements.push_back(absl::StrCat(where, ": we gave a triangle twice"));
  std::vector<uint32_t> different;
  std::set_symmetric_difference(ours.begin(), ours.end(), theirs.begin(), theirs.end(), std::back_inserter(different));
  if (different.empty()) return;
  ++tally.queries;
  for (const uint32_t id : different) {
    ++tally.ids;
    const bool is_ours = std::binary_search(ours.begin(), ours.end(), id);
    if (overlaps(id) != is_ours)
      report.disagreements.push_back(
          absl::StrCat(where, ": we ", is_ours ? "gave triangle " : "left out triangle ", id, " wrongly"));
    if (tally.first_difference.empty())
      tally.first_difference =
          absl::StrCat(where, ", triangle ", id, is_ours ? ", which it left out" : ", which it added");
  }
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_AGREEMENT_H_
