#include "core/index/hash_grid/cell_key.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "tests/support/random.h"

namespace locus::internal {
namespace {

TEST(CellKeyTest, IndicesRoundDownOnBothSidesOfZero) {
  const double per_unit = cells_per_unit(3);
  EXPECT_EQ(cell_index(0, per_unit), 0);
  EXPECT_EQ(cell_index(7.999, per_unit), 0);
  EXPECT_EQ(cell_index(8, per_unit), 1);
  EXPECT_EQ(cell_index(-0.001, per_unit), -1);
  EXPECT_EQ(cell_index(-8, per_unit), -1);
  EXPECT_EQ(cell_index(-8.001, per_unit), -2);
  EXPECT_EQ(brick_index(-0.001, per_unit), -1);
  EXPECT_EQ(brick_index(-32, per_unit), -1);
  EXPECT_EQ(brick_index(31.9, per_unit), 0);
}

TEST(CellKeyTest, IndicesAreExactAtTheEdgeOfTheWorldAndTheSmallestCell) {
  const double per_unit = cells_per_unit(kMinCellExponent);
  EXPECT_EQ(cell_index(1e9, per_unit), int64_t{1'000'000'000} << 20);
  EXPECT_EQ(cell_index(std::nextafter(-1e9, 0), per_unit), -(int64_t{1'000'000'000} << 20));
  EXPECT_EQ(cell_index(std::nextafter(1e9, 0), per_unit), (int64_t{1'000'000'000} << 20) - 1);
}

TEST(CellKeyTest, IndicesOfInfiniteCoordinatesAreDefined) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_GT(cell_index(kInfinity, 1), int64_t{1} << 61);
  EXPECT_LT(cell_index(-kInfinity, 1), -(int64_t{1} << 61));
}

TEST(CellKeyTest, EveryCellOfABrickHasItsOwnIndex) {
  for (const int64_t corner : {int64_t{0}, int64_t{-4}, int64_t{1} << 50}) {
    std::set<int> indices;
    for (int64_t i = 0; i < 64; ++i) {
      const GridKey cell{corner + (i & 3), corner + (i >> 2 & 3), corner + (i >> 4)};
      EXPECT_EQ(brick_of(cell), (GridKey{corner / 4, corner / 4, corner / 4}));
      indices.insert(index_in_brick(cell));
    }
    EXPECT_EQ(indices.size(), 64u);
    EXPECT_EQ(*indices.begin(), 0);
    EXPECT_EQ(*indices.rbegin(), 63);
  }
}

TEST(CellKeyTest, ExponentCoveringIsTheSmallestThatCovers) {
  EXPECT_EQ(exponent_covering(0, -20, 31), -20);
  EXPECT_EQ(exponent_covering(1e300, -20, 31), 31);
  test::Random random(1);
  for (int i = 0; i < 10'000; ++i) {
    const double length = i % 3 == 0 ? std::exp2(random.whole(-18, 28)) : random.magnitude(-18, 28);
    const int exponent = exponent_covering(length, -20, 31);
    EXPECT_LE(length, std::ldexp(1, exponent)) << length;
    EXPECT_GT(length, std::ldexp(1, exponent - 1)) << length;
  }
}

TEST(CellKeyTest, NeighbouringKeysHaveDifferentHashes) {
  std::set<size_t> low_bits;
  for (int64_t i = 0; i < 4096; ++i) {
    low_bits.insert(GridKeyHash()({(i & 15) - 8, (i >> 4 & 15) - 8, (i >> 8) - 8}) & 0xFFFFFF);
  }
  EXPECT_GT(low_bits.size(), 4080u);
}

TEST(CellKeyTest, CountsOfHugeRangesDoNotOverflow) {
  constexpr int64_t kFar = int64_t{1} << 52;
  const KeyRange range{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};
  EXPECT_GT(range.count(), 1e46);
  EXPECT_FALSE(range.empty());
}

}  // namespace
}  // namespace locus::internal
