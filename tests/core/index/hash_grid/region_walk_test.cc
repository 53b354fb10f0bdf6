// A walk of many regions equals separate visits of these regions: for each region it visits the same values in the same
// order, with the same amount of work. This holds after any moves, and for any number of values or bricks in a region.
#include "core/index/hash_grid/region_walk.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/index/hash_grid/hash_grid.h"
#include "tests/support/random.h"

namespace locus {
namespace {

using test::Random;

constexpr uint32_t kCount = 3000;
constexpr double kHalf = 200;

struct Visited {
  std::vector<Id> ids;
  Work work;
};

// Returns a grid of balls of two sizes. Some balls have moved, so that bricks have logs and dead slots (slots of values
// that were moved or removed).
GridSnapshot crowd(Random& random) {
  HashGrid grid;
  std::vector<GridItem> items(kCount);
  for (uint32_t i = 0; i < kCount; ++i) {
    items[i].entry.position = random.vector(kHalf);
    items[i].entry.id = i + 1;
    items[i].entry.kind = ShapeKind::kBall;
    items[i].handle = i;
    items[i].reach = i % 100 == 0 ? 40 : 1;
  }
  grid.apply({{}, {}, items});
  std::vector<GridMove> moves;
  for (uint32_t handle = 7; handle < kCount; handle += 31) {
    GridMove& move = moves.emplace_back();
    move.handle = handle;
    move.position = grid.at(handle).entry().position + random.vector(0.5);
  }
  GridMoves batch;
  batch.moves = moves;
  grid.apply({{}, batch, {}});
  return grid.snapshot();
}

std::vector<GridRegion> regions_in(const GridSnapshot& grid, Random& random, size_t count) {
  std::vector<GridRegion> regions;
  for (size_t i = 0; i < count; ++i) {
    const Balld ball = {random.vector(1.2 * kHalf), random.magnitude(-4, 8)};
    GridRegion region = {&grid, bounds_of(ball), ball};
    if (random.chance(0.5)) region.ball.reset();
    regions.push_back(region);
  }
  return regions;
}

template <class Visit>
Visited visited_by(const Visit& visit, size_t max_values = kCount) {
  Visited result;
  visit(result.work, [&](const GridRef& value) {
    result.ids.push_back(value.entry().id);
    return result.ids.size() < max_values;
  });
  return result;
}

void expect_same(const Visited& a, const Visited& b, size_t i) {
  EXPECT_EQ(a.ids, b.ids) << "region " << i;
  EXPECT_EQ(a.work.cells, b.work.cells) << "region " << i;
  EXPECT_EQ(a.work.tests, b.work.tests) << "region " << i;
}

TEST(RegionWalkTest, EveryRegionIsVisitedLikeASeparateVisit) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    const GridSnapshot grid = crowd(random);
    const std::vector<GridRegion> regions = regions_in(grid, random, 200);
    RegionWalk walk(0, regions.size(), [&](size_t i) { return regions[i]; });
    size_t values = 0;
    for (size_t i = 0; i < regions.size(); ++i) {
      const Visited own = visited_by([&](Work& work, const auto& visit) { regions[i].visit(work, visit); });
      expect_same(visited_by([&](Work& work, const auto& visit) { walk.visit(work, visit); }), own, i);
      values += own.ids.size();
    }
    EXPECT_GT(values, regions.size());
  }
}

// A later snapshot may have more, fewer or no bricks, and its bricks may have other values.
TEST(RegionWalkTest, ALaterSnapshotChangesNoVisit) {
  Random random(9);
  const GridSnapshot grid = crowd(random);
  const GridSnapshot later[] = {grid, crowd(random), HashGrid().snapshot()};
  std::vector<GridRegion> regions = regions_in(grid, random, 200);
  for (const GridSnapshot& other : later) {
    for (GridRegion& region : regions) region.later = &other;
    RegionWalk walk(0, regions.size(), [&](size_t i) { return regions[i]; });
    for (size_t i = 0; i < regions.size(); ++i) {
      const Visited own = visited_by([&](Work& work, const auto& visit) { regions[i].visit(work, visit); });
      expect_same(visited_by([&](Work& work, const auto& visit) { walk.visit(work, visit); }), own, i);
    }
  }
}

TEST(RegionWalkTest, AWalkFromTheMiddleVisitsUpToItsEnd) {
  Random random(6);
  const GridSnapshot grid = crowd(random);
  const std::vector<GridRegion> regions = regions_in(grid, random, 20);
  for (size_t begin = 0; begin < regions.size(); ++begin) {
    std::vector<size_t> requested;
    const auto region_of = [&](size_t i) {
      requested.push_back(i);
      return regions.at(i);
    };
    RegionWalk walk(begin, regions.size(), region_of);
    std::vector<size_t> expected;
    for (size_t i = begin; i < regions.size(); ++i) {
      expected.push_back(i);
      expect_same(visited_by([&](Work& work, const auto& visit) { walk.visit(work, visit); }),
                  visited_by([&](Work& work, const auto& visit) { regions[i].visit(work, visit); }), i);
    }
    EXPECT_EQ(requested, expected);
  }
}

TEST(RegionWalkTest, AVisitEndsWhenTheVisitorReturnsFalse) {
  Random random(7);
  const GridSnapshot grid = crowd(random);
  const Balld everything = {{}, 4 * kHalf}, some = {{}, 30};
  const std::vector<GridRegion> regions = {{&grid, bounds_of(everything), everything}, {&grid, bounds_of(some), some}};
  RegionWalk walk(0, regions.size(), [&](size_t i) { return regions[i]; });
  for (size_t i = 0; i < regions.size(); ++i)
    EXPECT_EQ(visited_by([&](Work& work, const auto& visit) { walk.visit(work, visit); }, 2).ids.size(), 2u);
}

TEST(RegionWalkTest, AnEmptyWalkRequestsNoRegion) {
  RegionWalk walk(3, 3, [](size_t) -> GridRegion {
    ADD_FAILURE() << "an empty walk has requested a region";
    return {};
  });
}

}  // namespace
}  // namespace locus
