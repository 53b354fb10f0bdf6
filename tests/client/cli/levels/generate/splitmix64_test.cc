#include "client/cli/levels/generate/splitmix64.h"

#include <gtest/gtest.h>

#include <array>

namespace locus::cli {
namespace {

// Checks the published first outputs for seed 1234567.
TEST(SplitMix64Test, GivesTheReferenceSequence) {
  SplitMix64 random(1234567);
  for (uint64_t expected : {6457827717110365317u, 3203168211198807973u, 9817491932198370423u, 4593380528125082431u,
                            16408922859458223821u}) {
    EXPECT_EQ(random.next(), expected);
  }
}

TEST(SplitMix64Test, BelowReachesEveryValueAndNeverTheBound) {
  SplitMix64 random(1);
  std::array<int, 7> counts{};
  for (int i = 0; i < 7000; ++i) ++counts.at(random.below(7));
  for (int count : counts) {
    EXPECT_GT(count, 800);
    EXPECT_LT(count, 1200);
  }
}

TEST(SplitMix64Test, UnitStaysInItsHalfOpenRange) {
  SplitMix64 random(2);
  double sum = 0;
  for (int i = 0; i < 10'000; ++i) {
    const double value = random.unit();
    ASSERT_GE(value, 0);
    ASSERT_LT(value, 1);
    sum += value;
  }
  EXPECT_NEAR(sum / 10'000, 0.5, 0.02);
}

}  // namespace
}  // namespace locus::cli
