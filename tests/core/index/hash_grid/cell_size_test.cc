#include "core/index/hash_grid/cell_size.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/index/hash_grid/cell_key.h"
#include "tests/support/random.h"

namespace locus::internal {
namespace {

std::vector<SampledValue> spread(size_t count, double half, double diameter) {
  test::Random random(count);
  std::vector<SampledValue> values;
  for (size_t i = 0; i < count; ++i) values.push_back({random.vector(half), diameter});
  return values;
}

TEST(CellSizeTest, CoincidentValuesOfAnySizeGetAFiniteCellSize) {
  for (const double diameter : {0.0, 1e-9, 1.0, 1e9, 1e12}) {
    const std::vector<SampledValue> values(4096, {{5, 5, 5}, diameter});
    const int exponent = choose_cell_exponent(values, 1'000'000);
    EXPECT_EQ(exponent, exponent_covering(std::max(diameter, 5 * 0x1p-16), kMinCellExponent, kMaxBaseExponent))
        << diameter;
  }
}

TEST(CellSizeTest, OneValueIsEnough) {
  const std::vector<SampledValue> values(1, {{1, 2, 3}, 0.5});
  EXPECT_EQ(choose_cell_exponent(values, 1), -1);
}

TEST(CellSizeTest, CellsOfAFewValuesAreNotMuchWiderThanTheirBounds) {
  EXPECT_EQ(choose_cell_exponent(spread(20, 0.9, 0.01), 20), 3);
  EXPECT_LE(choose_cell_exponent(spread(2000, 1, 0.25), 2000), 3);
}

TEST(CellSizeTest, EvenlySpreadValuesShareACellWithAboutTwentyFourOthersAtMost) {
  for (const size_t population : {4'096u, 100'000u, 1'000'000u}) {
    const double half = 500;
    const int exponent = choose_cell_exponent(spread(4096, half, 0.1), population);
    const double volume = std::exp2(3 * exponent);
    const double mean = static_cast<double>(population) * volume / (8 * half * half * half);
    EXPECT_LE(mean, 2 * kMaxMeanPerCell) << population;
    EXPECT_GE(mean, kMaxMeanPerCell / 16) << population;
  }
}

TEST(CellSizeTest, TheCellIsNeverSmallerThanTheMedianDiameter) {
  EXPECT_GE(choose_cell_exponent(spread(4096, 10, 3), 4096), 2);
}

TEST(CellSizeTest, CoincidentValuesDoNotShrinkTheCellsOfTheOthers) {
  std::vector<SampledValue> values = spread(2000, 1000, 0);
  values.insert(values.end(), 2096, {{3, 3, 3}, 0});
  const int exponent = choose_cell_exponent(values, values.size());
  EXPECT_GE(exponent, 6);
  EXPECT_LE(exponent, 9);
}

TEST(CellSizeTest, ACellSizeFitsWhileNeitherTooFewNorTooManyValuesShareACell) {
  const std::vector<SampledValue> values = spread(4096, 100, 0.5);
  const int chosen = choose_cell_exponent(values, 100'000);
  EXPECT_TRUE(cell_exponent_fits(values, 100'000, chosen));
  EXPECT_FALSE(cell_exponent_fits(values, 100'000, chosen - 3));
  EXPECT_FALSE(cell_exponent_fits(values, 100'000, chosen + 2));
}

}  // namespace
}  // namespace locus::internal
