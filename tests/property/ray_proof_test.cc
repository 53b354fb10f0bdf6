// No misses and no false hits: query results are compared with a reference in long double, for a million rays in each
// run and for a hundred million rays in the long run. LOCUS_PROOF_RAYS and LOCUS_PROOF_SEED set the number of rays and
// the seed of the long run.
#include "tests/support/proof/ray_proof.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr uint64_t kRaySeed = 4;

uint64_t number_from(const char* variable, uint64_t otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : static_cast<uint64_t>(std::strtod(text, nullptr));
}

void expect_a_clean_run(uint64_t rays, uint64_t seed) {
  RayProof proof(rays, seed, std::max(1u, std::thread::hardware_concurrency()));
  const RayTally tally = proof.run();
  std::printf("%s\n", proof.line().c_str());
  EXPECT_TRUE(tally.clean()) << proof.line() << "\n" << absl::StrJoin(tally.faults, "\n");
  EXPECT_GE(tally.rays, rays);
  EXPECT_GT(tally.hits, rays / 3) << "too few rays hit to prove anything";
  EXPECT_LT(tally.undecidable, rays / 20) << "too few answers were judged to prove anything";
}

TEST(RayProofTest, NoRayMissesAndNoneHitsWhatIsNotThere) { expect_a_clean_run(scaled_count(1'000'000), kRaySeed); }

TEST(LongRayProofTest, NoRayMissesAndNoneHitsWhatIsNotThere) {
  expect_a_clean_run(number_from("LOCUS_PROOF_RAYS", 100'000'000), number_from("LOCUS_PROOF_SEED", kRaySeed));
}

}  // namespace
}  // namespace locus::test
