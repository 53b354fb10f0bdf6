#include "core/index/hash_grid/hash_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "core/base/limits.h"
#include "tests/support/grid_comparison.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kWorld = limits::kMaxCoordinate;

static_assert(MutableSpatialIndex<ObjectGrid>);

Object ball(Id id, Vec3d center, float radius) {
  Object object;
  object.id = id;
  object.shape = {ShapeKind::kBall, center, {}, {}, radius};
  return object;
}

template <class Grid>
std::set<Id> ids_near(const Grid& grid, Vec3d center, double radius, Work* work = nullptr) {
  std::vector<Object> found;
  ball_overlap(grid, {center, radius}, found, work);
  std::set<Id> ids;
  for (const Object& object : found) EXPECT_TRUE(ids.insert(object.id).second) << "twice: " << object.id;
  return ids;
}

std::vector<Object> crowd(size_t count, double half, float radius, uint64_t seed) {
  Random random(seed);
  std::vector<Object> objects;
  for (size_t i = 0; i < count; ++i) objects.push_back(ball(i + 1, random.vector(half), radius));
  return objects;
}

// Returns options of a grid whose cell size is always 8.
HashGridOptions fixed_cells() {
  HashGridOptions options;
  options.first_choice = std::numeric_limits<size_t>::max();
  return options;
}

TEST(HashGridTest, AnEmptyGridGivesNoResults) {
  ObjectGrid grid;
  EXPECT_EQ(grid.size(), 0u);
  EXPECT_FALSE(grid.contains(ball(1, {}, 1)));
  EXPECT_FALSE(grid.remove(ball(1, {}, 1)));
  EXPECT_TRUE(ids_near(grid, {}, kWorld).empty());
  EXPECT_FALSE(any_ray(grid, ObjectRay({{0, 0, 0}, {1, 0, 0}}), kInfinity));
  grid.apply({}, {});
  EXPECT_EQ(grid.statistics().levels, 0u);
}

TEST(HashGridTest, MoveAcrossCellBorderLeavesNoGhostInTheOldCell) {
  ObjectGrid grid(fixed_cells());
  const Object before = ball(1, {7.9, 1, 1}, 0.05f), after = ball(1, {8.1, 1, 1}, 0.05f);
  grid.insert(before);
  grid.apply({&before, 1}, {&after, 1});
  EXPECT_EQ(grid.size(), 1u);
  EXPECT_FALSE(grid.contains(before));
  EXPECT_TRUE(grid.contains(after));
  EXPECT_TRUE(ids_near(grid, {7.9, 1, 1}, 0.1).empty());
  EXPECT_EQ(ids_near(grid, {8.1, 1, 1}, 0.1), std::set<Id>{1});
  EXPECT_EQ(grid.statistics().cells, 1u);
}

TEST(HashGridTest, AMoveThatChangesSizeChangesLevel) {
  ObjectGrid grid(fixed_cells());
  const Object small = ball(1, {1, 1, 1}, 0.5f), large = ball(1, {1, 1, 1}, 500);
  grid.insert(small);
  grid.apply({&small, 1}, {&large, 1});
  EXPECT_EQ(grid.size(), 1u);
  EXPECT_EQ(grid.statistics().levels, 1u);
  EXPECT_EQ(ids_near(grid, {400, 0, 0}, 1), std::set<Id>{1});
}

TEST(HashGridTest, RemoveRemovesOnlyTheGivenId) {
  ObjectGrid grid;
  const Object first = ball(1, {1, 1, 1}, 1), second = ball(2, {1, 1, 1}, 1);
  grid.insert(first);
  grid.insert(second);
  EXPECT_TRUE(grid.remove(first));
  EXPECT_FALSE(grid.remove(first));
  EXPECT_FALSE(grid.contains(first));
  EXPECT_TRUE(grid.contains(second));
  EXPECT_EQ(ids_near(grid, {1, 1, 1}, 0), std::set<Id>{2});
}

TEST(HashGridTest, EmptyBricksAndLevelsAreFreed) {
  ObjectGrid grid(fixed_cells());
  std::vector<Object> objects = crowd(500, 1000, 0.5f, 1);
  for (size_t i = 0; i < objects.size(); i += 5) objects[i].shape.radius = 100;
  grid.apply({}, objects);
  EXPECT_EQ(grid.statistics().levels, 2u);
  EXPECT_GT(grid.statistics().bricks, 100u);
  grid.apply(objects, {});
  const GridStatistics empty = grid.statistics();
  EXPECT_EQ(grid.size(), 0u);
  EXPECT_EQ(empty.levels, 0u);
  EXPECT_EQ(empty.bricks, 0u);
  EXPECT_EQ(empty.cells, 0u);
  EXPECT_EQ(empty.bytes, 0u);
}

TEST(HashGridTest, OneCellHoldsMoreThan65535Values) {
  ObjectGrid grid;
  const std::vector<Object> objects(crowd(70'000, 0.001, 0, 2));
  grid.apply({}, objects);
  EXPECT_EQ(grid.size(), objects.size());
  EXPECT_EQ(ids_near(grid, {}, 1).size(), objects.size());
  grid.apply(absl::MakeConstSpan(objects).first(69'999), {});
  EXPECT_EQ(ids_near(grid, {}, 1), std::set<Id>{70'000});
}

TEST(HashGridTest, ManyObjectsInOneCellGiveTheResultsOfTheList) {
  TestScene<Object> scene;
  scene.name = "one cell";
  Random random(3);
  for (Id id = 1; id <= 20'000; ++id) {
    scene.values.push_back(ball(id, Vec3d{1004, 1004, 52} + random.vector(4), random.float_between(0, 0.5)));
  }
  scene.balls = {{{1004, 1004, 52}, 10}, {{1000, 1000, 48}, 2}};
  scene.boxes = {{{1008, 1004, 52}, {0, 1, 1}, {}}};
  scene.rays.emplace_back(Rayd{{900, 1003, 51}, {1, 0.01, 0.01}});
  scene.rays.emplace_back(Rayd{{1004, 1004, 52}, {0, 0, -1}});
  for (const size_t first_choice : {size_t{1000}, std::numeric_limits<size_t>::max()}) {
    HashGridOptions options;
    options.first_choice = first_choice;
    ObjectGrid grid(options);
    grid.apply({}, scene.values);
    EXPECT_EQ(first_difference(grid, scene), "");
  }
}

TEST(HashGridTest, ASnapshotKeepsItsValuesWhileTheGridChanges) {
  const std::vector<Object> objects = crowd(2'000, 50, 0.5f, 4);
  ObjectGrid grid;
  grid.apply({}, objects);
  const ObjectSet snapshot = grid.snapshot();
  std::vector<Object> moved = objects;
  for (Object& object : moved) object.shape.position.x += 1000;
  grid.apply(objects, moved);
  EXPECT_EQ(ids_near(snapshot, {}, 100).size(), objects.size());
  EXPECT_TRUE(ids_near(snapshot, {1000, 0, 0}, 100).empty());
  EXPECT_TRUE(ids_near(grid, {}, 100).empty());
  EXPECT_EQ(ids_near(grid, {1000, 0, 0}, 100).size(), objects.size());
}

TEST(HashGridTest, ForEachVisitsEveryValueOnceInTheSameOrderEveryTime) {
  const std::vector<Object> objects = crowd(3'000, 100, 1, 5);
  const auto order = [&objects] {
    ObjectGrid grid;
    grid.apply({}, objects);
    std::vector<Id> ids;
    grid.for_each([&ids](const Object& object) { ids.push_back(object.id); });
    return ids;
  };
  const std::vector<Id> ids = order();
  EXPECT_EQ(order(), ids);
  EXPECT_EQ(std::set<Id>(ids.begin(), ids.end()).size(), objects.size());
  EXPECT_EQ(ids.size(), objects.size());
}

TEST(HashGridTest, TheCellSizeFollowsTheValuesAndChangesNoResult) {
  Random random(6);
  SceneSketch sketch = random_scene(random);
  TestScene<Object> scene = make_scene<Object>(sketch, random);
  scene.values = crowd(5'000, 3, 0.01f, 6);
  std::set<double> sizes;
  ObjectGrid grid;
  for (size_t count = 0; count < scene.values.size(); count += 100) {
    grid.apply({}, absl::MakeConstSpan(scene.values).subspan(count, 100));
    sizes.insert(grid.statistics().cell_size);
  }
  EXPECT_EQ(first_difference(grid, scene), "");
  EXPECT_GE(sizes.size(), 2u);
  EXPECT_LT(grid.statistics().cell_size, 2);
  std::vector<Object> before = scene.values;
  for (int round = 0; round < 34; ++round) {
    std::vector<Object> spread = scene.values;
    for (Object& object : spread) object.shape.position = object.shape.position * (1000 + round);
    grid.apply(before, spread);
    before = std::move(spread);
  }
  EXPECT_GT(grid.statistics().cell_size, 100);
  scene.values = before;
  EXPECT_EQ(first_difference(grid, scene), "");
}

// After a new cell size is chosen, each batch moves only a part of the values to the new cells, so that the time of a
// batch is limited.
TEST(HashGridTest, AfterANewCellSizeEachBatchRefilesAFewValuesAndResultsStayCorrect) {
  Random random(9);
  std::vector<Object> objects = crowd(40'000, 1000, 0.01f, 9);
  ObjectGrid grid;
  grid.apply({}, objects);
  const double first_size = grid.statistics().cell_size;
  const auto insert_in_the_middle = [&] {
    const size_t before = objects.size();
    for (int i = 0; i < 500; ++i) objects.push_back(ball(objects.size() + 1, random.vector(5), 0.01f));
    return grid.apply({}, absl::MakeConstSpan(objects).subspan(before));
  };
  while (grid.statistics().cell_size == first_size) {
    insert_in_the_middle();
    ASSERT_LT(objects.size(), 100'000u) << "no other cell size was chosen";
  }
  int batches = 1;
  // Each batch that moves values to other cells makes new bricks; an insertion in the middle alone does not.
  for (size_t bricks = 0; bricks != grid.statistics().bricks; ++batches) {
    bricks = grid.statistics().bricks;
    const double radius = random.chance(0.5) ? 1 : 200;
    const Balld ball_query{random.vector(3), radius};
    size_t expected = 0;
    for (const Object& object : objects) expected += ball_overlaps(ball_query, object.shape) ? 1 : 0;
    EXPECT_EQ(ids_near(grid, ball_query.center, radius).size(), expected);
    EXPECT_LT(insert_in_the_middle(), grid.statistics().bytes / 2);
    ASSERT_LT(batches, 100) << "refiling does not end";
  }
  EXPECT_GT(batches, 3);
  EXPECT_EQ(ids_near(grid, {}, 1e6).size(), objects.size());
}

// Half of the objects in a hub of 20 x 20 x 20, the others, one in 8,000 cubic units, around it.
std::vector<Object> hub_in_open_country(Vec3d hub, uint64_t seed) {
  Random random(seed);
  std::vector<Object> objects;
  for (Id id = 1; id <= 20'000; ++id)
    objects.push_back(ball(id, id % 2 == 0 ? hub + random.vector(10) : random.vector(215), 0.1f));
  return objects;
}

size_t cells_visited(const ObjectGrid& grid, Vec3d center, double radius) {
  Work work;
  ids_near(grid, center, radius, &work);
  return work.cells;
}

TEST(HashGridTest, ACrowdElsewhereDoesNotMakeQueriesInOpenCountryVisitMoreCells) {
  const std::vector<Object> objects = hub_in_open_country({}, 11);
  std::vector<Object> country;
  for (const Object& object : objects)
    if (object.id % 2 != 0) country.push_back(object);
  ObjectGrid with, without;
  with.apply({}, objects);
  without.apply({}, country);
  for (const Vec3d center : {Vec3d{150, 150, 150}, Vec3d{-100, 120, -80}, Vec3d{0, 0, 200}}) {
    EXPECT_LE(cells_visited(with, center, 50), 4 * cells_visited(without, center, 50));
    EXPECT_EQ(ids_near(with, center, 50), ids_near(without, center, 50));
  }
  EXPECT_LE(with.statistics().bytes, 3 * without.statistics().bytes);
}

// The hub moves through the country a few thousand objects at a time: what was dense becomes sparse, and the reverse.
TEST(HashGridTest, TheCellsFollowACrowdThatMoves) {
  std::vector<Object> objects = hub_in_open_country({}, 12);
  ObjectGrid grid;
  grid.apply({}, objects);
  const size_t bytes = grid.statistics().bytes, cells = cells_visited(grid, {150, 150, 150}, 50);
  Random random(13);
  for (int round = 1; round <= 4; ++round) {
    const Vec3d hub = {100.0 * (round % 2), 100.0 * (round / 2 % 2), 0};
    for (size_t first = 0; first < objects.size(); first += 2'000) {
      const std::vector<Object> before(objects.begin() + static_cast<ptrdiff_t>(first),
                                       objects.begin() + static_cast<ptrdiff_t>(first + 2'000));
      for (size_t i = first; i < first + 2'000; ++i)
        if (objects[i].id % 2 == 0) objects[i].shape.position = hub + random.vector(10);
      grid.apply(before, absl::MakeConstSpan(objects).subspan(first, 2'000));
    }
    const std::set<Id> near = ids_near(grid, hub, 30);
    size_t expected = 0;
    for (const Object& object : objects) expected += ball_overlaps(Balld{hub, 30}, object.shape) ? 1 : 0;
    EXPECT_EQ(near.size(), expected);
    EXPECT_LE(cells_visited(grid, {150, 150, 150}, 50), 2 * cells) << "after round " << round;
    EXPECT_LE(grid.statistics().bytes, 2 * bytes) << "after round " << round;
  }
}

TEST(HashGridTest, OptionsRoundTheCellSizeUpToAPowerOfTwoWithinBounds) {
  const auto cell_size = [](double requested) {
    HashGridOptions options;
    options.cell_size = requested;
    return ObjectGrid(options).statistics().cell_size;
  };
  EXPECT_EQ(cell_size(8), 8);
  EXPECT_EQ(cell_size(9), 16);
  EXPECT_EQ(cell_size(0), 0x1p-20);
  EXPECT_EQ(cell_size(1e300), 0x1p+31);
}

TEST(HashGridTest, AGiantDoesNotWidenLookupsForSmallObjects) {
  const std::vector<Object> objects = crowd(20'000, 1000, 0.5f, 7);
  ObjectGrid grid;
  grid.apply({}, objects);
  Work without, with;
  ids_near(grid, {10, 20, 30}, 10, &without);
  grid.insert(ball(1'000'000, {}, 5000));
  EXPECT_TRUE(ids_near(grid, {10, 20, 30}, 10, &with).contains(1'000'000));
  EXPECT_LE(with.cells, without.cells + 4);
  EXPECT_EQ(with.tests, without.tests + 1);
}

TEST(HashGridTest, AnInfiniteRayInASparseWorldVisitsFewCells) {
  ObjectGrid grid(fixed_cells());
  std::vector<Object> objects;
  for (Id id = 1; id <= 200; ++id) {
    const double at = kWorld * static_cast<double>(id) / 201;
    objects.push_back(ball(id, {at, -at, id % 2 == 0 ? at : 0}, id % 5 == 0 ? 1e5f : 1));
  }
  grid.apply({}, objects);
  for (const Vec3d direction : lattice_directions()) {
    Work work;
    any_ray(grid, ObjectRay({{0.3, 0.2, 0.1}, direction}), kInfinity, &work);
    EXPECT_LE(work.cells, 3 * objects.size());
  }
  Work work;
  std::vector<RayHit<Object>> hits;
  all_rays(grid, ObjectRay({{0, 0, 0}, {1, -1, 0}}), kInfinity, 1000, hits, &work);
  EXPECT_EQ(hits.size(), 100u);
}

TEST(HashGridTest, AWorldWideRegionVisitsEachBrickOnce) {
  ObjectGrid grid(fixed_cells());
  grid.apply({}, crowd(100, kWorld, 1, 8));
  Work work;
  EXPECT_EQ(ids_near(grid, {}, 3 * kWorld, &work).size(), 100u);
  EXPECT_LE(work.cells, 200u);
}

TEST(HashGridTest, AShortRayInACrowdVisitsFewCells) {
  ObjectGrid grid;
  grid.apply({}, crowd(100'000, 1000, 0.5f, 9));
  Work work;
  any_ray(grid, ObjectRay({{1, 2, 3}, {1, 0.2, -0.1}}), 100, &work);
  EXPECT_LE(work.cells, 2'000u);
  EXPECT_LE(work.tests, 200u);
}

TEST(HashGridTest, AHitEndsTheMarchOfTheRay) {
  ObjectGrid grid(fixed_cells());
  std::vector<Object> objects = crowd(50'000, 1000, 0.5f, 10);
  objects.push_back(ball(60'000, {5, 2, 3}, 2));
  grid.apply({}, objects);
  const ObjectRay ray({{1, 2, 3}, {1, 0, 0}});
  Work to_the_hit, all_the_way;
  Object first;
  double t = 1'000;
  EXPECT_TRUE(first_ray(grid, ray, first, t, &to_the_hit));
  EXPECT_LE(t, 2);
  std::vector<RayHit<Object>> hits;
  all_rays(grid, ray, 1'000, 1'000, hits, &all_the_way);
  EXPECT_LT(to_the_hit.cells * 4, all_the_way.cells);
}

TEST(HashGridTest, ACursorResumesBehindTheLastVisitedValueEvenWithinABrick) {
  ObjectGrid grid;
  grid.apply({}, crowd(3000, 50, 1, 1));
  const ObjectSet set = grid.snapshot();
  Random random(2);
  GridCursor cursor;
  std::vector<Id> ids;
  for (bool all = false; !all;) {
    uint64_t steps = 1 + random.below(700);
    all = set.grid().for_each_from(cursor, [&](const GridRef& value) {
      ids.push_back(value.entry().id);
      return --steps > 0;
    });
  }
  std::vector<Id> at_once;
  set.for_each([&](const Object& object) { at_once.push_back(object.id); });
  std::sort(ids.begin(), ids.end());
  std::sort(at_once.begin(), at_once.end());
  EXPECT_EQ(ids, at_once);
}

TEST(HashGridTest, AGridFilledWithTheCellSizeOfAnotherHasTheSameBricks) {
  HashGrid chosen, filled;
  std::vector<GridItem> items;
  for (const Object& object : crowd(5000, 500, 1, 1)) items.push_back(grid_item_of(object, uint32_t(items.size())));
  chosen.apply({{}, {}, items});
  std::vector<GridItem> in_order;
  chosen.for_each([&](const GridRef& value) {
    in_order.push_back(value.item());
    return true;
  });
  filled.fill(in_order, chosen.cell_size());
  EXPECT_EQ(filled.cell_size(), chosen.cell_size());
  EXPECT_EQ(filled.size(), chosen.size());
  EXPECT_EQ(filled.snapshot().statistics().bricks, chosen.snapshot().statistics().bricks);
  EXPECT_EQ(filled.snapshot().cell_size(), chosen.cell_size());
}

TEST(HashGridDeathTest, RemovingAnAbsentObjectIsAProgrammerError) {
  ObjectGrid grid;
  grid.insert(ball(1, {1, 1, 1}, 1));
  const Object other = ball(2, {1, 1, 1}, 1);
  EXPECT_DEATH(grid.apply({&other, 1}, {}), "known");
}

}  // namespace
}  // namespace locus::test
