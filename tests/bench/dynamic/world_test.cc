#include "tests/bench/dynamic/world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

// Tests of the drawn numbers. Another program computed the expected values from the definition in world.h.
namespace locus::bench::dynamic {
namespace {

void expect_near(Vec3f value, Vec3f expected) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(value[axis], expected[axis], 2e-7 * (1000 + expected[axis])) << axis;
}

Vec3f third(const World& world) { return point_at(world.objects().positions, 2); }

World moved(Kind kind) {
  World world(kind, 1000);
  for (int tick = 0; tick < 20; ++tick) world.step();
  return world;
}

TEST(WorldTest, PositionsOfEveryKindAreTheKnownOnes) {
  expect_near(third(World(Kind::kUniform, 1000)), {648.866394f, 318.358551f, 89.3939056f});
  expect_near(third(World(Kind::kClustered, 1000)), {1825.38037f, 603.712463f, 13.1584883f});
  expect_near(third(World(Kind::kFar, 1000)), {1000648.88f, 1000318.38f, 89.3939056f});
  expect_near(third(World(Kind::kOneCell, 1000)), {1002.59546f, 1001.27344f, 55.1515121f});
  expect_near(third(World(Kind::kBorder, 1000)), {648, 312, 88});
}

TEST(WorldTest, TwentyTicksLeadToTheKnownPositions) {
  expect_near(third(moved(Kind::kUniform)), {648.713806f, 316.131989f, 90.5270233f});
  expect_near(third(moved(Kind::kOneCell)), {1002.44287f, 1001.05078f, 55.6047897f});
  expect_near(third(moved(Kind::kBorder)), {808, 312, 88});
}

TEST(WorldTest, NoObjectLeavesTheWorld) {
  const World world = moved(Kind::kBorder);
  for (uint32_t i = 0; i < world.count(); ++i) {
    const Vec3f p = point_at(world.objects().positions, i);
    EXPECT_TRUE(p.x >= 0 && p.x <= 2000 && p.y >= 0 && p.y <= 2000 && p.z >= 0 && p.z <= 100) << i;
  }
}

TEST(WorldTest, RadiiAreEqualExceptInGiantAndMixedWorlds) {
  EXPECT_EQ(World(Kind::kUniform, 1000).objects().radii[0], 0.5f);
  EXPECT_EQ(World(Kind::kGiant, 1000).objects().radii[0], 5000);
  EXPECT_EQ(World(Kind::kGiant, 1000).objects().radii[1], 0.5f);
  const World mixed(Kind::kMixed, 1000);
  EXPECT_NEAR(mixed.objects().radii[0], 1.02582026f, 1e-6);
  EXPECT_NEAR(mixed.objects().radii[2], 0.353743374f, 1e-6);
}

TEST(WorldTest, IdsAreUniqueAndHaveTheHighestBitClear) {
  const World world(Kind::kUniform, 10'000);
  std::set<uint64_t> ids(world.objects().ids.begin(), world.objects().ids.end());
  EXPECT_EQ(ids.size(), 10'000u);
  EXPECT_EQ(ids.count(0), 0u);
  EXPECT_LT(*ids.rbegin(), uint64_t{1} << 63);
}

TEST(WorldTest, QueriesAreTheKnownOnes) {
  const Queries queries = queries_of(World(Kind::kUniform, 1000), 2);
  ASSERT_EQ(queries.centers.size(), 2u);
  expect_near(queries.centers[1], {1889.30981f, 1307.32849f, 70.5206528f});
  expect_near(queries.rays[1].origin, {1336.44031f, 377.213287f, 36.6735382f});
  expect_near(queries.rays[1].direction, {-0.324614137f, -0.934834242f, 0.143912002f});
}

TEST(WorldTest, NamesAreShort) {
  EXPECT_EQ(World(Kind::kOneCell, 10'000).name(), "onecell/10k");
  EXPECT_EQ(name_of_count(1'000'000), "1M");
  EXPECT_EQ(name_of_count(1234), "1234");
}

}  // namespace
}  // namespace locus::bench::dynamic
