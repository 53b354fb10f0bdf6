// Grids and the list give bitwise equal results for every cell size, every order and batching of updates, and every
// previous content of the grid.
#include <gtest/gtest.h>

#include "tests/support/grid_comparison.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

TEST(HashGridEqualsListTest, OnRandomScenes) {
  const auto draw = [](uint64_t, Random& random) { return random_scene(random); };
  EXPECT_EQ(search_grid_scenes(scaled_count(10'000), draw, grid_difference), "");
}

TEST(HashGridEqualsListTest, OnAdversarialScenes) {
  EXPECT_EQ(search_grid_scenes(scaled_count(2'400), adversarial_scene, grid_difference), "");
}

TEST(HashGridEqualsListTest, OnAdversarialGridScenes) {
  EXPECT_EQ(search_grid_scenes(scaled_count(2'000), grid_scene, grid_difference), "");
}

TEST(HashGridEqualsListTest, OnBallsVisitedByBallInsteadOfByBounds) {
  EXPECT_EQ(search_grid_scenes(scaled_count(1'000), any_adversarial_scene, grid_ball_difference), "");
}

TEST(HashGridEqualsListTest, ThroughRandomInsertsMovesAndRemoves) {
  EXPECT_EQ(search_grid_scenes(scaled_count(300), any_adversarial_scene, moving_grid_difference), "");
}

// The scenes are so large that rays march through many bricks, several levels have many bricks each, and the grid
// chooses its cell size.
TEST(HashGridEqualsListTest, OnTensOfThousandsOfObjects) {
  for (uint64_t seed = 0; seed < scaled_count(20); ++seed) {
    Random random(seed);
    SceneSketch sketch{"a crowd", {}, {}, {}, {}};
    const double ladder = seed % 4 == 3 ? 8 : 0;
    for (int i = 0; i < 20'000; ++i) {
      const double size = 0.5 * random.magnitude(-ladder, ladder / 2);
      const Vec3d town = {1000.0 * random.whole(0, 1), -1000, 50};
      const Vec3d center = seed % 2 == 0 ? random.vector(1000) : town + random.vector(60);
      sketch.placements.push_back({center, random.positive_vector(size), random.rotation()});
    }
    add_queries(sketch, 10, 40, random);
    const ObjectScene scene = make_scene<Object>(sketch, random);
    HashGridOptions options;
    if (seed % 3 == 0) options.first_choice = static_cast<size_t>(-1);
    ObjectGrid grid(options);
    const absl::Span<const Object> all(scene.values);
    for (size_t i = 0; i < 10; ++i) grid.apply({}, all.subspan(i * 2'000, 2'000));
    ASSERT_EQ(first_difference(grid, scene), "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus::test
