#include "core/geometry/vec3.h"

#include <limits>

#include "gtest/gtest.h"

namespace locus {
namespace {

// Rounds two numbers to float and back. GCC 12.2 would drop the rounding if its SLP vectoriser, which the build
// disables, packed the two conversions.
[[gnu::noinline]] void round_through_float(const double* __restrict in, double* __restrict out) {
  for (int i = 0; i < 2; ++i) out[i] = static_cast<double>(static_cast<float>(in[i]));
}

TEST(Vec3Test, RoundingToFloatIsKeptByTheOptimizer) {
  const double in[2] = {0.1, 0.2};
  double out[2] = {};
  round_through_float(in, out);
  EXPECT_EQ(out[0], double{0.1f});
  EXPECT_EQ(out[1], double{0.2f});
}

// Returns a * b + c; a fused multiply-add would not round the product.
[[gnu::noinline]] double product_and_sum(double a, double b, double c) { return a * b + c; }

TEST(Vec3Test, ProductsAreRoundedBeforeTheyAreAdded) {
  const double a = 1 + 0x1p-30;
  EXPECT_EQ(product_and_sum(a, a, -(1 + 0x1p-29)), 0);
}

TEST(Vec3Test, NormalizedAcceptsTheShortestAndTheLongestVectors) {
  for (const double size : {1e-300, 1e-30, 1.0, 1e30, 1e300}) {
    const Vec3d unit = normalized(Vec3d{3 * size, 0, -4 * size});
    EXPECT_NEAR(unit.x, 0.6, 1e-15);
    EXPECT_EQ(unit.y, 0);
    EXPECT_NEAR(unit.z, -0.8, 1e-15);
  }
}

TEST(Vec3Test, CrossIsPerpendicularByTheRightHandRule) {
  EXPECT_EQ(cross(Vec3d{1, 0, 0}, Vec3d{0, 1, 0}), (Vec3d{0, 0, 1}));
  EXPECT_EQ(dot(cross(Vec3d{1, 2, 3}, Vec3d{4, 5, 6}), Vec3d{1, 2, 3}), 0);
}

TEST(Vec3Test, IsFiniteChecksEveryComponent) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(is_finite(Vec3d{1, 2, 3}));
  EXPECT_FALSE(is_finite(Vec3d{infinity, 0, 0}));
  EXPECT_FALSE(is_finite(Vec3d{0, std::nan(""), 0}));
  EXPECT_FALSE(is_finite(Vec3d{0, 0, -infinity}));
}

}  // namespace
}  // namespace locus
