// Shells are the regions around a point that a nearest search visits one after another. They miss no value and are
// finite in number; the values of a shell are visited from near to far; and a search from empty space does not visit
// the empty cells between the point and the values.
#include "core/index/hash_grid/nearest_walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/grid_comparison.h"

namespace locus::internal {
namespace {

using test::ObjectGrid;
using test::Random;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

LevelGeometry world_of(double half) { return {{{-half, -half, -half}, {half, half, half}}, 0.5, 1.0 / 8}; }

Object ball(Id id, Vec3d center, float radius = 0.5f) {
  Object object;
  object.id = id;
  object.shape = {ShapeKind::kBall, center, {}, {}, radius};
  return object;
}

std::vector<Object> crowd(size_t count, double half, uint64_t seed) {
  Random random(seed);
  std::vector<Object> objects;
  for (size_t i = 0; i < count; ++i) objects.push_back(ball(i + 1, random.vector(half)));
  return objects;
}

// Returns the number of cells and bricks that a search for the nearest `count` objects visits.
uint64_t cells_of(const ObjectGrid& grid, Vec3d point, size_t count) {
  std::vector<ValueAt<Object>> found;
  Work work;
  nearest_values(grid, point, kInfinity, count, found, &work);
  EXPECT_EQ(found.size(), std::min(count, grid.size()));
  return work.cells;
}

TEST(NearestWalkTest, ShellsAreAdjacentAndTheLastContainsTheWorld) {
  const LevelGeometry world = world_of(1000);
  NearestShells shells({10, 20, 30}, world, 12);
  float last = -1;
  Aabbd region;
  int count = 0;
  for (; shells.next(kInfinity); ++count) {
    EXPECT_EQ(shells.above(), last);
    EXPECT_GT(shells.up_to(), last);
    EXPECT_TRUE(count == 0 || contains(shells.region(), region));
    last = shells.up_to();
    region = shells.region();
  }
  EXPECT_TRUE(contains(region, world.bounds));
  EXPECT_EQ(last, std::numeric_limits<float>::infinity());
  EXPECT_LT(count, 20);
}

TEST(NearestWalkTest, ShellsEndAtTheLimit) {
  const LevelGeometry world = world_of(1000);
  NearestShells shells({}, world, 12);
  EXPECT_TRUE(shells.next(4));
  EXPECT_EQ(shells.up_to(), key_limit(4));
  EXPECT_FALSE(shells.next(4));
  EXPECT_FALSE(shells.next(1));
}

TEST(NearestWalkTest, TheFirstShellIsNarrowerAtHigherDensity) {
  const LevelGeometry world = world_of(1000);
  NearestShells few({}, world, 1), many({}, world, 1000);
  ASSERT_TRUE(few.next(kInfinity) && many.next(kInfinity));
  EXPECT_LT(many.up_to(), few.up_to() / 10);
}

TEST(NearestWalkTest, TheFirstShellOfAPointOutsideOverlapsTheWorld) {
  const LevelGeometry world = world_of(100);
  NearestShells shells({1e6, 0, 0}, world, 12);
  ASSERT_TRUE(shells.next(kInfinity));
  EXPECT_TRUE(overlaps(shells.region(), world.bounds));
  EXPECT_FALSE(contains(shells.region(), world.bounds));
}

TEST(NearestWalkTest, TheKeyOfALimitIsNotBelowTheLimit) {
  for (const double limit : {0.0, 1e-300, 1e-60, 1e-44, 1.0, 1e30, 3e38, 1e60, kInfinity})
    EXPECT_GE(double{key_limit(limit)}, limit > 1e38 ? 1e38 : limit) << limit;
  EXPECT_EQ(key_limit(1e60), std::numeric_limits<float>::infinity());
}

// A kernel sorts up to kMaxSorted candidates; std::sort() sorts a larger number.
TEST(NearestWalkTest, AnyNumberOfValuesIsVisitedOnceAndFromNearToFar) {
  const Vec3d center = {1000, 1000, 1000};
  for (const size_t count : {1, 7, 8, 9, 63, 64, 65, 2000}) {
    std::vector<Object> objects = crowd(count, 20, count);
    for (Object& object : objects) object.shape.position = object.shape.position + center;
    HashGridOptions options;
    options.first_choice = std::numeric_limits<size_t>::max();  // otherwise the grid would choose cells as wide as the
                                                                // world for a few objects
    ObjectGrid grid(options);
    grid.apply({}, objects);
    const ObjectSet set = grid.snapshot();
    std::vector<double> away;
    Work work;
    const auto visit = [&](const GridRef& value) {
      away.push_back(std::sqrt(squared_distance(center, bounds_of(shape_of(value)))));
      return true;
    };
    set.grid().visit_nearest(
        center, [] { return kInfinity; }, work, visit);
    EXPECT_EQ(away.size(), count);
    EXPECT_EQ(work.tests, count);
    for (size_t i = 1; i < away.size(); ++i) EXPECT_GE(away[i], away[i - 1] - 0.01) << count;
  }
}

TEST(NearestWalkTest, FewValuesBesidesTheNearestAreVisitedInACrowd) {
  ObjectGrid grid;
  grid.apply({}, crowd(50'000, 500, 1));
  Random random(2);
  Work work;
  for (int i = 0; i < 100; ++i) {
    std::vector<ValueAt<Object>> found;
    nearest_values(grid, random.vector(450), kInfinity, 8, found, &work);
  }
  EXPECT_LT(work.tests, 100 * 12);
}

TEST(NearestWalkTest, APointFarFromACrowdVisitsFewCells) {
  ObjectGrid grid;
  grid.apply({}, crowd(50'000, 500, 1));
  const uint64_t all = grid.statistics().bricks * 16 + grid.statistics().cells;
  for (const double away : {600.0, 1e4, 1e6, 1e9}) EXPECT_LT(cells_of(grid, {away, 0, 0}, 8), all) << away;
}

TEST(NearestWalkTest, AFewDistantObjectsCostVisitsOfAFewBricks) {
  ObjectGrid grid;
  grid.apply({}, crowd(20, 1e8, 1));
  const size_t bricks = grid.statistics().bricks;
  EXPECT_LT(cells_of(grid, {1, 2, 3}, 20), 20 * bricks);
  EXPECT_LT(cells_of(grid, {1, 2, 3}, 1), 20 * bricks);
}

}  // namespace
}  // namespace locus::internal
