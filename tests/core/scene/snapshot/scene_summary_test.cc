#include "core/scene/snapshot/scene_summary.h"

#include <thread>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

class SceneSummaryTest : public SceneFixture {};

TEST_F(SceneSummaryTest, AnEmptySceneHasNoBounds) {
  const SceneSummary summary = scene_.summary();
  EXPECT_EQ(summary.objects, 0u);
  EXPECT_TRUE(summary.bounds.empty());
}

TEST_F(SceneSummaryTest, TheBoundsContainAllObjectsExactly) {
  apply(with(points({1, 2, 3}, {1, 2, 3, -4, 5, 6, 7, -8, 9})));
  const SceneSummary summary = scene_.summary();
  EXPECT_EQ(summary.objects, 3u);
  EXPECT_EQ(summary.revision, 1u);
  EXPECT_EQ(summary.bounds.min, (Vec3d{-4, -8, 3}));
  EXPECT_EQ(summary.bounds.max, (Vec3d{7, 5, 9}));
}

// Returns the bounds of all objects by visiting each of them.
Aabbd walked_bounds(const ObjectSet& objects) {
  Aabbd bounds;
  objects.for_each([&bounds](const Object& object) { bounds = merge(bounds, bounds_of(object.shape)); });
  return bounds;
}

// Returns the bounds that the grid finds, and adds the number of visited objects to `visits`.
Aabbd grid_bounds(const ObjectSet& objects, size_t& visits) {
  Work work;
  return objects.grid().bounds(
      [&visits](const GridRef& object) {
        ++visits;
        return bounds_of(shape_of(object));
      },
      work);
}

TEST_F(SceneSummaryTest, BoundsEqualThoseOfAWalkAfterRandomUpdates) {
  for (uint64_t seed = 1; seed <= scaled_count(20); ++seed) {
    Random random(seed);
    ObjectStore store;
    const bool is_flat = seed % 3 == 0;
    const double reach = random.magnitude(0, 16);
    const auto position = [&] {
      Vec3d at = random.vector(random.chance(0.02) ? reach : reach / 8);
      if (is_flat) at.z = 7;
      return at;
    };
    for (int step = 0; step < 60; ++step) {
      std::vector<Object> removed, inserted;
      for (Id id = 1; id <= 500; ++id) {
        if (!random.chance(step == 0 ? 1 : 0.1)) continue;
        if (const std::optional<Object> known = store.find(id)) removed.push_back(*known);
        if (step > 0 && random.chance(0.2)) continue;
        Object object;
        object.id = id;
        object.shape.kind = static_cast<ShapeKind>(random.whole(0, 3));
        object.shape.position = position();
        const float size = random.chance(0.01) ? 200.0f : 0.5f;
        if (object.shape.kind == ShapeKind::kBall || object.shape.kind == ShapeKind::kCapsule)
          object.shape.radius = size;
        if (object.shape.kind == ShapeKind::kBox || object.shape.kind == ShapeKind::kCapsule)
          object.shape.size = {size, size / 2, size / 4};
        inserted.push_back(object);
      }
      store.apply(removed, inserted);
      const ObjectSet objects = store.snapshot();
      size_t visits = 0;
      ASSERT_EQ(grid_bounds(objects, visits), walked_bounds(objects)) << "seed " << seed << ", step " << step;
    }
  }
}

// Objects at one side, or long in another direction than the side's, are more than the culling can tell apart. Then all
// values are visited, once.
TEST_F(SceneSummaryTest, BoundsOfManyObjectsAtOneSideVisitAtMostTwiceAsMany) {
  constexpr Id kCount = 300'000;
  for (const Vec3f size : {Vec3f{}, Vec3f{50, 50, 0.1f}, Vec3f{0.1f, 0.1f, 1000}}) {
    Random random(1);
    std::vector<Object> flat(kCount);
    for (Id id = 1; id <= kCount; ++id) {
      flat[id - 1].id = id;
      if (size.z > 0) flat[id - 1].shape.kind = ShapeKind::kBox;
      flat[id - 1].shape.size = size;
      flat[id - 1].shape.position = random.vector(1000);
      flat[id - 1].shape.position.z = 5;
    }
    ObjectStore store;
    store.apply({}, flat);
    const ObjectSet objects = store.snapshot();
    size_t visits = 0;
    const Aabbd bounds = grid_bounds(objects, visits);
    EXPECT_EQ(bounds, walked_bounds(objects)) << size.x;
    EXPECT_LT(visits, 3 * kCount) << size.x;
  }
}

TEST_F(SceneSummaryTest, BoundsVisitFewOfManyObjects) {
  constexpr Id kCount = 200'000;
  Random random(2);
  std::vector<Object> balls(kCount);
  for (Id id = 1; id <= kCount; ++id) {
    balls[id - 1].id = id;
    balls[id - 1].shape = {ShapeKind::kBall, random.vector(1000), {}, {}, 0.5f};
  }
  ObjectStore store;
  store.apply({}, balls);
  const ObjectSet objects = store.snapshot();
  size_t visits = 0;
  const Aabbd bounds = grid_bounds(objects, visits);
  EXPECT_EQ(bounds, walked_bounds(objects));
  EXPECT_LT(visits, kCount / 20);
}

TEST_F(SceneSummaryTest, TheStructuresOfASceneAreMeasured) {
  const SceneStructures empty = structures_of(*scene_.latest());
  EXPECT_EQ(empty.static_levels, 0u);
  EXPECT_EQ(empty.static_nodes, 0u);
  EXPECT_EQ(empty.object_levels, 0u);
  EXPECT_EQ(empty.object_bricks, 0u);
  ASSERT_TRUE(scene_.apply(with(points({1, 2}, {0, 0, 0, 5000, 0, 0}))).ok());
  const SceneStructures sizes = structures_of(*scene_.latest());
  const GridStatistics grid = scene_.latest()->objects.statistics();
  EXPECT_EQ(sizes.object_levels, grid.levels);
  EXPECT_EQ(sizes.object_bricks, grid.bricks);
  EXPECT_GT(sizes.object_bytes, 0u);
  EXPECT_EQ(sizes.cell_size, scene_.latest()->objects.grid().cell_size());
}

TEST_F(SceneSummaryTest, ASummaryIsKnownUntilTheNextRevision) {
  EXPECT_FALSE(scene_.known_summary().has_value());
  EXPECT_EQ(scene_.summary().revision, 0u);
  ASSERT_TRUE(scene_.known_summary().has_value());
  apply(with(points({1}, {1, 2, 3})));
  EXPECT_FALSE(scene_.known_summary().has_value());
  EXPECT_EQ(scene_.summary().objects, 1u);
  EXPECT_EQ(scene_.known_summary()->revision, 1u);
}

TEST_F(SceneSummaryTest, ASummaryIsNeverOlderThanItsCall) {
  std::vector<std::thread> callers;
  std::atomic<bool> end{false};
  for (int i = 0; i < 3; ++i)
    callers.emplace_back([&] {
      while (!end.load()) {
        const uint64_t before = scene_.latest()->revision;
        const SceneSummary summary = scene_.summary();
        EXPECT_GE(summary.revision, before);
        EXPECT_EQ(summary.objects, summary.revision);  // each batch inserts one object
      }
    });
  for (Id id = 1; id <= 200; ++id) apply(with(points({id}, {0, 0, 0})));
  end.store(true);
  for (std::thread& caller : callers) caller.join();
}

}  // namespace
}  // namespace locus::test
