// CONSERVATIVE finds everything that EXACT finds, at the same distance or nearer. For instances, every other row is
// explained by the bounds of a placed triangle, also far from the world's origin.
#include <gtest/gtest.h>

#include "tests/support/conservative_answers.h"
#include "tests/support/placed_scenes.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

void expect_superset(const QueryScene& scene, uint64_t seed) {
  ASSERT_EQ(superset_fault(scene), "") << scene.world.name << ", seed " << seed;
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInRandomScenes) {
  for (uint64_t seed = 0; seed < scaled_count(1'500); ++seed) {
    Random random(seed);
    expect_superset(query_scene(random_scene(random), random), seed);
  }
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInAdversarialScenes) {
  for (uint64_t seed = 0; seed < scaled_count(800); ++seed) {
    Random random(seed);
    expect_superset(query_scene(troublesome_sketch(seed, random), random), seed);
  }
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInMeshesFarFromTheirOwnOrigin) {
  for (uint64_t seed = 0; seed < scaled_count(400); ++seed) {
    Random random(seed);
    expect_superset(brought_back_scene(random), seed);
  }
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInThePlaneOfRotatedTriangles) {
  for (uint64_t seed = 0; seed < scaled_count(1'000); ++seed) {
    Random random(seed);
    expect_superset(turned_floor_scene(random), seed);
  }
}

TEST(QueryConservativeTest, FindsAllThatExactFindsWhereRoundingToMeshAxesMakesShapesTouch) {
  for (uint64_t seed = 0; seed < scaled_count(1'000); ++seed) {
    Random random(seed);
    expect_superset(touching_scene(random), seed);
  }
}

TEST(QueryConservativeTest, FindsAllThatExactFindsWhereRaysGrazeTheCornersOfTriangles) {
  for (uint64_t seed = 0; seed < scaled_count(1'000); ++seed) {
    Random random(seed);
    expect_superset(grazing_scene(random), seed);
  }
}

TEST(QueryConservativeTest, FindsAllThatExactFindsFarFromTheWorldsOrigin) {
  for (uint64_t seed = 0; seed < scaled_count(2'000); ++seed) {
    Random random(seed);
    expect_superset(far_scene(random), seed);
  }
}

TEST(QueryConservativeTest, BoundsOfPlacedTrianglesAreTightFarFromTheWorldsOrigin) {
  for (uint64_t seed = 0; seed < scaled_count(2'000); ++seed) {
    Random random(seed);
    ASSERT_EQ(placed_bounds_fault(far_scene(random)), "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus::test
