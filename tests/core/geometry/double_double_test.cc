#include "core/geometry/double_double.h"

#include <cmath>

#include "gtest/gtest.h"
#include "tests/support/quad.h"
#include "tests/support/random.h"

namespace locus {
namespace {

using test::Quad;
using test::Random;

constexpr uint64_t kSumSeed = 91;

double any(Random& random) { return random.between(-1, 1) * random.magnitude(-60, 60); }

TEST(DoubleDoubleTest, ProductsOfTwoDoublesAreExact) {
  Random random(kSumSeed);
  for (int i = 0; i < 100000; ++i) {
    const double a = any(random), b = any(random);
    const DoubleDouble product = DoubleDouble(a) * b;
    ASSERT_EQ(product.rounded(), a * b) << "seed " << kSumSeed << " case " << i;
    ASSERT_EQ((product - a * b).rounded(), std::fma(a, b, -(a * b))) << "seed " << kSumSeed << " case " << i;
  }
}

TEST(DoubleDoubleTest, SumsOfTwoDoublesAreExact) {
  Random random(kSumSeed + 1);
  for (int i = 0; i < 100000; ++i) {
    const double a = any(random), b = any(random);
    const DoubleDouble sum = DoubleDouble(a) + b;
    ASSERT_EQ(sum.rounded(), a + b) << "seed " << kSumSeed << " case " << i;
    ASSERT_EQ((sum - a).rounded(), b) << "seed " << kSumSeed << " case " << i;
    ASSERT_EQ((sum - b).rounded(), a) << "seed " << kSumSeed << " case " << i;
  }
}

TEST(DoubleDoubleTest, SumsOfProductsHaveARelativeErrorBelowTwoToTheMinus100) {
  Random random(kSumSeed + 2);
  for (int i = 0; i < 100000; ++i) {
    const double a = any(random), b = any(random), c = any(random), d = any(random), e = any(random);
    const DoubleDouble result = (DoubleDouble(a) * b + c) * (DoubleDouble(d) - e);
    const Quad exact = (Quad{a} * b + c) * (Quad{d} - e);
    const Quad found = Quad{result.rounded()} + (result - result.rounded()).rounded();
    // The error bound is relative to the size of the operands, since the sum a * b + c has fewer exact bits if its
    // terms almost cancel.
    const Quad size = (std::abs(a * b) + std::abs(c)) * (std::abs(d) + std::abs(e));
    ASSERT_LE(std::abs(static_cast<double>(found - exact)), 0x1p-100 * static_cast<double>(size))
        << "seed " << kSumSeed + 2 << " case " << i;
  }
}

// Watertightness depends on the exact change of sign: the two triangles at an edge compute the same edge function with
// opposite signs.
TEST(DoubleDoubleTest, SwappingTheProductsOfADifferenceOnlyFlipsItsSign) {
  Random random(kSumSeed + 3);
  for (int i = 0; i < 100000; ++i) {
    const DoubleDouble a = DoubleDouble(any(random)) + any(random), b = DoubleDouble(any(random)) + any(random);
    const DoubleDouble c = DoubleDouble(any(random)) * any(random), d = DoubleDouble(any(random)) * any(random);
    ASSERT_EQ(a * b - c * d, -(d * c - b * a)) << "seed " << kSumSeed + 3 << " case " << i;
  }
}

TEST(DoubleDoubleTest, SignIsExactWhereDoubleRoundsToZero) {
  const DoubleDouble one = 1.0;
  EXPECT_EQ((one + 0x1p-100 - one).sign(), 1);
  EXPECT_EQ((one - 0x1p-100 - one).sign(), -1);
  EXPECT_EQ((one - one).sign(), 0);
}

}  // namespace
}  // namespace locus
