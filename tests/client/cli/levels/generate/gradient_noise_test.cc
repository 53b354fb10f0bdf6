#include "client/cli/levels/generate/gradient_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client/cli/levels/generate/splitmix64.h"

namespace locus::cli {
namespace {

std::array<double, 3> any_point(SplitMix64& random, double range) {
  std::array<double, 3> point{};
  for (double& coordinate : point) coordinate = (random.unit() * 2 - 1) * range;
  return point;
}

TEST(GradientNoiseTest, ItStaysWithinMinusOneToOneAndUsesMostOfTheRange) {
  SplitMix64 random(1);
  double low = 0;
  double high = 0;
  for (int i = 0; i < 200'000; ++i) {
    const double value = gradient_noise(any_point(random, 1000), 3);
    low = std::min(low, value);
    high = std::max(high, value);
  }
  EXPECT_GE(low, -1);
  EXPECT_LE(high, 1);
  EXPECT_LT(low, -0.7);
  EXPECT_GT(high, 0.7);
}

TEST(GradientNoiseTest, ItIsZeroAtIntegerCoordinates) {
  for (int x = -3; x <= 3; ++x)
    for (int y = -3; y <= 3; ++y) EXPECT_EQ(gradient_noise({x * 1.0, y * 1.0, 7}, 9), 0);
}

TEST(GradientNoiseTest, ItIsContinuousAcrossCellBorders) {
  SplitMix64 random(2);
  constexpr double kStep = 0x1p-40;
  for (int i = 0; i < 10'000; ++i) {
    std::array<double, 3> point = any_point(random, 100);
    point[random.below(3)] = std::floor(point[0]);
    std::array<double, 3> before = point;
    for (double& coordinate : before) coordinate -= kStep;
    ASSERT_NEAR(gradient_noise(point, 5), gradient_noise(before, 5), 16 * kStep);
  }
}

TEST(GradientNoiseTest, DifferentSeedsGiveDifferentFields) {
  EXPECT_NE(gradient_noise({0.3, 0.4, 0.5}, 1), gradient_noise({0.3, 0.4, 0.5}, 2));
}

TEST(FractalNoiseTest, OneOctaveIsTheNoiseAtItsWavelength) {
  SplitMix64 seed(11);
  EXPECT_EQ(fractal_noise({3, 5, 9}, 16, 1, 11), gradient_noise({3 / 16.0, 5 / 16.0, 9 / 16.0}, seed.next()));
}

TEST(FractalNoiseTest, OctavesAddDetailAndStayWithinOne) {
  SplitMix64 random(3);
  for (int i = 0; i < 20'000; ++i) {
    const std::array<double, 3> point = any_point(random, 1000);
    ASSERT_LE(std::abs(fractal_noise(point, 64, 6, 4)), 1);
  }
  EXPECT_NE(fractal_noise({3, 5, 9}, 16, 1, 11), fractal_noise({3, 5, 9}, 16, 2, 11));
}

}  // namespace
}  // namespace locus::cli
