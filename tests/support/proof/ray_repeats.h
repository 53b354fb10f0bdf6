// Repeats the rays of a block with mode ANY, with mode ALL, or with limits at or just before the first hits. The first
// hits, which are already verified, determine the answers of mode ANY, the nearest row of each answer of mode ALL, and
// the answers with limits. The reference verifies the other rows of mode ALL. Used by the proof that no ray misses.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_RAY_REPEATS_H_
#define LOCUS_TESTS_SUPPORT_PROOF_RAY_REPEATS_H_

#include <cmath>

#include "tests/support/proof/ray_judge.h"

namespace locus::test {

namespace internal {

inline bool same_row(const BlockResult& a, size_t row_a, const BlockResult& b, size_t row_b) {
  return a.t[row_a] == b.t[row_b] && a.ids[row_a] == b.ids[row_b] && a.triangles[row_a] == b.triangles[row_b];
}

inline void count_repeat(bool same, const char* way, const OwnedBlock& block, size_t ray, RayTally& tally) {
  ++tally.repeats;
  if (same) return;
  ++tally.differing_repeats;
  tally.note(absl::StrFormat("answered otherwise %s: %s", way, describe(block, ray)));
}

inline RayTally repeat_as_any(const ProofScene& scene, OwnedBlock block, const BlockResult& first) {
  RayTally tally;
  rays_of(block).mode = RayMode::kAny;
  const BlockResult any = run_block(*scene.snapshot, block);
  for (size_t i = 0; i < first.t.size(); ++i)
    count_repeat((any.hits[i] != '\0') == (first.ids[i] != kNoId), "as any hit", block, i, tally);
  return tally;
}

inline RayTally repeat_as_all(const ProofScene& scene, OwnedBlock block, const BlockResult& first) {
  rays_of(block).mode = RayMode::kAll;
  block.settings.max_results = 4'096;
  const BlockResult all = run_block(*scene.snapshot, block);
  RayTally tally;
  if (all.truncated.empty()) tally = judge_all_hits(scene, block, all);
  tally.rays = tally.hits = tally.undecidable = 0;  // these are counted when the first hits are verified
  for (size_t i = 0, row = 0; i < first.t.size(); row += all.counts[i++]) {
    const bool hit = first.ids[i] != kNoId;
    const bool same = (all.counts[i] != 0) == hit && (!hit || same_row(all, row, first, i));
    count_repeat(same, "as the first of all hits", block, i, tally);
  }
  return tally;
}

// Repeats the rays, each with a limit exactly at its hit. The answers must not change.
inline RayTally repeat_with_limit_at_hit(const ProofScene& scene, OwnedBlock block, const BlockResult& first) {
  RayTally tally;
  for (size_t i = 0; i < first.t.size(); ++i)
    if (first.ids[i] != kNoId) block.extras[i] = first.t[i];
  const BlockResult limited = run_block(*scene.snapshot, block);
  for (size_t i = 0; i < first.t.size(); ++i)
    count_repeat(same_row(limited, i, first, i), "with a limit at its hit", block, i, tally);
  return tally;
}

// Repeats the rays with a limit just before a first hit at t > 0: there must be no hit. Rays with a first hit at t = 0
// must give the same answer again.
inline RayTally repeat_with_limit_before_hit(const ProofScene& scene, OwnedBlock block, const BlockResult& first) {
  RayTally tally;
  for (size_t i = 0; i < first.t.size(); ++i)
    if (first.t[i] > 0 && first.ids[i] != kNoId) block.extras[i] = std::nextafter(first.t[i], 0.0f);
  const BlockResult limited = run_block(*scene.snapshot, block);
  for (size_t i = 0; i < first.t.size(); ++i) {
    const bool lost = first.t[i] > 0 && limited.ids[i] == kNoId;
    const bool kept = first.t[i] == 0 && same_row(limited, i, first, i);
    count_repeat(lost || kept, "with a limit before its hit", block, i, tally);
  }
  return tally;
}

}  // namespace internal

// Repeats the rays in a way chosen at random.
inline RayTally repeat_rays(const ProofScene& scene, const OwnedBlock& block, const BlockResult& first,
                            Random& random) {
  switch (random.below(4)) {
    case 0:
      return internal::repeat_as_any(scene, block, first);
    case 1:
      return internal::repeat_as_all(scene, block, first);
    case 2:
      return internal::repeat_with_limit_at_hit(scene, block, first);
    default:
      return internal::repeat_with_limit_before_hit(scene, block, first);
  }
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_RAY_REPEATS_H_
