// Sums of doubles and of products, compared with integers of 128 bits.
#include "core/geometry/exact_sum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus {
namespace {

__extension__ typedef __int128 Integer;

int sign_of(Integer value) { return (value > 0) - (value < 0); }

TEST(ExactSumTest, TheSumOfNothingIsZero) { EXPECT_EQ(ExactSum<1>().sign(), 0); }

TEST(ExactSumTest, ALargeNumberThatCancelsLeavesASmallOne) {
  ExactSum<4> sum;
  sum.add(0x1p300);
  sum.add(-0x1p-300);
  EXPECT_EQ(sum.sign(), 1);
  sum.add(-0x1p300);
  EXPECT_EQ(sum.sign(), -1);
  sum.add(0x1p-300);
  EXPECT_EQ(sum.sign(), 0);
}

TEST(ExactSumTest, AProductIsAddedWithItsRoundingError) {
  // The exact value of (1 + e)^2 - (1 + 2 e) is e^2. In double, (1 + e)^2 is rounded to 1 + 2 e, so the result is 0.
  ExactSum<4> sum;
  const double e = 0x1p-40;
  sum.add(DoubleDouble(1 + e) * DoubleDouble(1 + e));
  sum.add(-(1 + 2 * e));
  EXPECT_EQ(sum.sign(), 1);
  sum.add(-e * e);
  EXPECT_EQ(sum.sign(), 0);
}

TEST(ExactSumTest, SignsEqualThoseOfIntegers) {
  for (uint64_t seed = 0; seed < test::scaled_count(20'000); ++seed) {
    test::Random random(seed);
    ExactSum<24> sum;
    Integer expected = 0;
    std::vector<double> summands;
    for (int i = 0; i < 8; ++i) {
      const int shift = random.whole(0, 66);
      const auto digits = static_cast<int64_t>(random.below(uint64_t{1} << random.whole(1, 52))) - 1000;
      summands.push_back(std::ldexp(static_cast<double>(digits), shift));
      expected += Integer{digits} * (Integer{1} << shift);
    }
    for (const double summand : summands) sum.add(summand);
    ASSERT_EQ(sum.sign(), sign_of(expected)) << "seed " << seed;
    // Subtract all summands but the first, so that most of the sum cancels.
    for (size_t i = 1; i < summands.size(); ++i) sum.add(-summands[i]);
    ASSERT_EQ(sum.sign(), sign_of(static_cast<Integer>(summands[0]))) << "seed " << seed;
    sum.add(-summands[0]);
    ASSERT_EQ(sum.sign(), 0) << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus
