#include "core/index/hash_grid/density_map.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/support/random.h"

namespace locus::internal {
namespace {

constexpr double kFull = 64;

// Returns a map of `crowded` values within 1 of the origin and `lone` values within 1000 of it. The base cell is 1.
DensityCount count_of(int crowded, int lone) {
  DensityCount count(0, {{-1000, -1000, -1000}, {1000, 1000, 1000}});
  test::Random random(7);
  for (int i = 0; i < crowded; ++i) count.add(random.vector(1), 1);
  for (int i = 0; i < lone; ++i) count.add(random.vector(1000), 1);
  return count;
}

GridKey brick_at(Vec3d position, int exponent) { return brick_of(cell_of(position, cells_per_unit(exponent))); }

TEST(DensityMapTest, WithoutSparseRegionsEveryPositionIsOnTheBaseLevel) {
  EXPECT_EQ(DensityMap(3).exponent_at({1e6, -1e6, 5}), 3);
  EXPECT_EQ(count_of(1000, 0).map(kFull, nullptr).exponent_at({900, 900, 900}), 0);
}

TEST(DensityMapTest, LoneValuesGetWiderCellsThanACrowd) {
  const DensityMap map = count_of(4000, 4000).map(kFull, nullptr);
  EXPECT_EQ(map.exponent_at({0.5, 0.5, 0.5}), 0);
  EXPECT_GE(map.exponent_at({900, 900, 900}), 4);
  EXPECT_EQ(map.exponent_at({900, 900, 900}) % 2, 0);
}

TEST(DensityMapTest, APositionOutsideAllNodesIsOnTheCoarsestLevel) {
  const DensityMap map = count_of(4000, 4000).map(kFull, nullptr);
  EXPECT_EQ(map.exponent_at({1e9, 1e9, -1e9}), 10);  // bricks of the level 10 are 4096 wide
}

TEST(DensityMapTest, ANodeRemainsDenseUntilItsBricksAreLessThanHalfAsFull) {
  const auto map_of = [](int crowded, const DensityMap* before) { return count_of(crowded, 4000).map(kFull, before); };
  const Vec3d middle = {-0.5, -0.5, -0.5};  // an eighth of the crowd is in its node
  const DensityMap dense = map_of(8 * 80, nullptr);
  EXPECT_EQ(dense.exponent_at(middle), 0);
  EXPECT_EQ(map_of(8 * 48, &dense).exponent_at(middle), 0);
  EXPECT_GT(map_of(8 * 48, nullptr).exponent_at(middle), 0);
  EXPECT_GT(map_of(8 * 16, &dense).exponent_at(middle), 0);
}

TEST(DensityMapTest, AFewSparseNodesAtTheEdgeOfAUniformWorldAreIgnored) {
  DensityCount count(0, {{0, 0, 0}, {64, 64, 64}});
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 4; ++z) count.add({16.0 * x, 16.0 * y, 16.0 * z}, x + y + z == 0 ? 3 : 1000);
  EXPECT_EQ(count.map(kFull, nullptr).exponent_at({1, 1, 1}), 0);
}

// Returns a brick with `values` values, all in the first cell or evenly in all 64 cells.
Brick brick_of_values(const GridKey& key, int exponent, uint32_t values, bool in_one_cell) {
  Brick brick;
  brick.geometry = BrickGeometry::of(key, exponent);
  const auto block = std::make_shared<GridBlock>(values, false);
  for (uint32_t cell = 0; cell < kBrickCells; ++cell)
    block->offsets()[cell + 1] = in_one_cell ? values : values * (cell + 1) / kBrickCells;
  brick.sorted = block;
  return brick;
}

TEST(DensityMapTest, OccupiedCellsOfABrickCountAsTheBricksThatItsValuesWouldFill) {
  for (const int exponent : {1, 2}) {  // of the node, and of a level between it and the base level
    const auto level_of = [exponent](uint32_t values, bool in_one_cell) {
      DensityCount count(0, {{0, 0, 0}, {1024, 1024, 1024}});
      count.add(brick_of_values({}, exponent, values, in_one_cell));
      for (int i = 1; i < 60; ++i) count.add({17.0 * i, 17.0 * i, 17.0 * i}, 1);
      return count.map(kFull, nullptr).exponent_at({1, 1, 1});
    };
    const uint32_t bricks = exponent == 2 ? 64 : 8;
    EXPECT_EQ(level_of(80, true), 0);
    EXPECT_GT(level_of(80, false), 0);
    EXPECT_GT(level_of(60 * bricks, false), 0);
    EXPECT_EQ(level_of(66 * bricks, false), 0);
  }
}

TEST(DensityMapTest, ACrowdInOneOfManyBricksMakesTheirNodeDense) {
  const auto level_of = [](int crowd) {
    DensityCount count(0, {{0, 0, 0}, {1000, 1000, 1000}});
    for (int i = 0; i < 64; ++i) count.add({4.0 * (i % 4), 4.0 * (i / 4 % 4), 4.0 * (i / 16)}, i == 5 ? crowd : 1);
    for (int i = 2; i < 60; ++i) count.add({17.0 * i, 17.0 * i, 17.0 * i}, 1);
    return count.map(kFull, nullptr).exponent_at({1, 1, 1});
  };
  EXPECT_EQ(level_of(8 * 64), 0);
  EXPECT_GT(level_of(7 * 64), 0);
}

TEST(DensityMapTest, ANodeWithADenseChildIsDense) {
  DensityCount count(0, {{0, 0, 0}, {1000, 1000, 1000}});
  count.add({1, 1, 1}, 100);
  for (int i = 1; i < 40; ++i) count.add({20.0 * i, 20.0 * i, 20.0 * i}, 1);
  const DensityMap map = count.map(kFull, nullptr);
  EXPECT_EQ(map.exponent_at({1, 1, 1}), 0);
  EXPECT_EQ(map.exponent_at({20, 20, 20}), 2);
  EXPECT_EQ(map.exponent_at({100, 100, 100}), 4);
}

// Each position whose level changes must be in a brick for which differs() is true, or its value would stay where it
// is.
TEST(DensityMapTest, EveryBrickWhoseValuesBelongElsewhereDiffers) {
  const DensityMap maps[] = {DensityMap(0), count_of(4000, 4000).map(kFull, nullptr),
                             count_of(100, 4000).map(kFull, nullptr), count_of(0, 400'000).map(kFull, nullptr)};
  test::Random random(8);
  int changed = 0;
  for (const DensityMap& before : maps) {
    for (const DensityMap& after : maps) {
      for (int i = 0; i < 1000; ++i) {
        const Vec3d position = random.vector(i % 2 == 0 ? 2 : 1000);
        for (const int size : {0, 1, 3}) {  // exponent that the size of a value requires
          const int from = std::max(before.exponent_at(position), size);
          if (std::max(after.exponent_at(position), size) == from) continue;
          ++changed;
          ASSERT_TRUE(after.differs(before, brick_at(position, from), from)) << from << " at " << position.x;
        }
      }
    }
  }
  EXPECT_GT(changed, 1000);
}

}  // namespace
}  // namespace locus::internal
