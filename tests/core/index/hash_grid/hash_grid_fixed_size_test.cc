// A fixed cell size of the hash grid: values move to cells of another size in steps, and no answer changes.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/index/hash_grid/hash_grid.h"
#include "tests/support/grid_comparison.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

Object ball(Id id, Vec3d center) {
  Object object;
  object.id = id;
  object.shape = {ShapeKind::kBall, center, {}, {}, 0.5f};
  return object;
}

std::vector<Object> crowd(size_t count, double half, uint64_t seed) {
  Random random(seed);
  std::vector<Object> objects;
  for (size_t i = 0; i < count; ++i) objects.push_back(ball(i + 1, random.vector(half)));
  return objects;
}

std::set<Id> ids_near(const ObjectGrid& grid, Vec3d center, double radius) {
  std::vector<Object> found;
  ball_overlap(grid, {center, radius}, found);
  std::set<Id> ids;
  for (const Object& object : found) EXPECT_TRUE(ids.insert(object.id).second) << "twice: " << object.id;
  return ids;
}

TEST(HashGridFixedSizeTest, ValuesMoveToTheNewCellsAFewThousandPerBatch) {
  ObjectGrid grid;
  std::vector<Object> objects = crowd(40'000, 500, 1);
  grid.apply({}, objects);
  const double chosen = grid.cell_size();
  const size_t bricks = grid.statistics().bricks;
  const std::set<Id> near = ids_near(grid, {10, 20, 30}, 100);
  grid.fix_cell_size(16 * chosen);
  EXPECT_EQ(grid.statistics().bricks, bricks) << "no value moves without a batch";
  size_t steps = 0;
  for (size_t before = 0; steps < 20 && before != grid.statistics().bricks; ++steps) {
    before = grid.statistics().bricks;
    const Object was = objects[steps];
    objects[steps].shape.position.x += 0.25;
    grid.apply({&was, 1}, {&objects[steps], 1});
    EXPECT_EQ(grid.cell_size(), 16 * chosen);
    EXPECT_EQ(grid.size(), objects.size());
  }
  EXPECT_GT(steps, 3u) << "40,000 values take several batches";
  EXPECT_LT(grid.statistics().bricks, bricks / 4);
  EXPECT_EQ(ids_near(grid, {10, 20, 30}, 100), near);
}

// Values that lie far apart in cells of the fixed size belong in wider cells, of which the map of densities must not
// conclude that all is dense: then each batch would move all values to narrow cells or back.
TEST(HashGridFixedSizeTest, ValuesThatAreSparseInCellsOfTheFixedSizeStayInWiderCells) {
  Random random(3);
  std::vector<Object> objects = crowd(10'000, 250, 3);
  for (Object& object : objects) object.shape.radius = static_cast<float>(0.125 * std::exp2(7 * random.unit()));
  ObjectGrid built;
  built.fix_cell_size(0.5);
  built.apply({}, objects);
  const size_t bricks = built.statistics().bricks;
  EXPECT_LT(bricks, objects.size() / 50);

  ObjectGrid changed;
  changed.apply({}, objects);
  ASSERT_GT(changed.cell_size(), 8) << "the fixed size is not far from the chosen one";
  changed.fix_cell_size(0.5);
  ObjectGrid grown;
  grown.fix_cell_size(0.5);
  for (size_t begin = 0; begin < objects.size(); begin += 1'000)
    grown.apply({}, absl::MakeConstSpan(objects).subspan(begin, 1'000));
  for (ObjectGrid* const grid : {&changed, &grown}) {
    for (int i = 0; i < 5; ++i) grid->apply({}, {});
    for (int i = 0; i < 5; ++i) {
      EXPECT_LE(grid->statistics().bricks, 2 * bricks);
      grid->apply({&objects[0], 1}, {&objects[0], 1});
    }
  }
}

TEST(HashGridFixedSizeTest, ASizeIsRoundedUpAndKeptUntilItIsChosenAgain) {
  ObjectGrid grid;
  grid.fix_cell_size(3);
  const std::vector<Object> objects = crowd(20'000, 500, 2);
  grid.apply({}, absl::MakeConstSpan(objects).first(9'000));
  EXPECT_EQ(grid.cell_size(), 4);
  grid.apply({}, absl::MakeConstSpan(objects).subspan(9'000));
  EXPECT_EQ(grid.cell_size(), 4) << "the number of values has doubled";
  ObjectGrid free;
  free.apply({}, objects);
  ASSERT_NE(free.cell_size(), 4);
  grid.fix_cell_size(0);
  EXPECT_EQ(grid.cell_size(), 4) << "a choice needs a batch";
  const Object one = ball(99'999, {});
  grid.insert(one);
  for (int i = 0; i < 20; ++i) grid.apply({}, {});  // values of an earlier choice move first
  EXPECT_EQ(grid.cell_size(), free.cell_size());
}

TEST(HashGridFixedSizeTest, AnyChangesOfTheSizeBetweenBatchesChangeNoAnswer) {
  for (uint64_t seed = 0; seed < scaled_count(60); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const ObjectScene scene = make_scene<Object>(grid_scene(seed, random), random);
    ObjectGrid grid(random_grid_options(random));
    std::vector<Object> present;
    const size_t step = 1 + scene.values.size() / 6;
    for (size_t begin = 0; begin < scene.values.size(); begin += step) {
      const auto added = absl::MakeConstSpan(scene.values).subspan(begin, step);
      if (random.chance(0.7)) grid.fix_cell_size(random.chance(0.2) ? 0 : random.magnitude(-20, 31));
      grid.apply({}, added);
      present.insert(present.end(), added.begin(), added.end());
      if (random.chance(0.3)) grid.fix_cell_size(random.magnitude(-6, 12));
      ObjectScene part = scene;
      part.values = present;
      ASSERT_EQ(IndexJudge(grid, make_list(present)).difference(part), "");
    }
  }
}

}  // namespace
}  // namespace locus::test
