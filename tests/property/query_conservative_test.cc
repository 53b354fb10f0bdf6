// A query of precision CONSERVATIVE finds everything that the same query of precision EXACT finds, at the same distance
// or nearer. It may also find objects and triangles that the EXACT query does not find; but a triangle is found only if
// the query intersects the triangle's bounds in world axes. Both properties also hold far from the world's origin.
#include <gtest/gtest.h>

#include "tests/support/conservative_answers.h"
#include "tests/support/placed_scenes.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

// Generates `count` scenes, one for each seed, and expects that CONSERVATIVE finds all that EXACT finds in each scene.
template <class Draw>
void expect_supersets(uint64_t count, const Draw& draw) {
  for (uint64_t seed = 0; seed < scaled_count(count); ++seed) {
    Random random(seed);
    const QueryScene scene = draw(random, seed);
    ASSERT_EQ(superset_fault(scene), "") << scene.world.name << ", seed " << seed;
  }
}

// Returns a function that ignores its seed and calls `draw`.
auto drawn_by(QueryScene (*draw)(Random&)) {
  return [draw](Random& random, uint64_t) { return draw(random); };
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInRandomScenes) {
  expect_supersets(1'500, [](Random& random, uint64_t) { return query_scene(random_scene(random), random); });
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInAdversarialScenes) {
  expect_supersets(800,
                   [](Random& random, uint64_t seed) { return query_scene(troublesome_sketch(seed, random), random); });
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInMeshesFarFromTheirOwnOrigin) {
  expect_supersets(400, drawn_by(brought_back_scene));
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInThePlaneOfRotatedTriangles) {
  expect_supersets(1'000, drawn_by(turned_floor_scene));
}

TEST(QueryConservativeTest, FindsAllThatExactFindsWhereRoundingToMeshAxesMakesShapesTouch) {
  expect_supersets(1'000, drawn_by(touching_scene));
}

TEST(QueryConservativeTest, FindsAllThatExactFindsWhereRaysGrazeTheCornersOfTriangles) {
  expect_supersets(1'000, drawn_by(grazing_scene));
}

TEST(QueryConservativeTest, FindsAllThatExactFindsFarFromTheWorldsOrigin) {
  expect_supersets(2'000, drawn_by(far_scene));
}

TEST(QueryConservativeTest, BoundsOfPlacedTrianglesAreTightFarFromTheWorldsOrigin) {
  for (uint64_t seed = 0; seed < scaled_count(2'000); ++seed) {
    Random random(seed);
    ASSERT_EQ(placed_bounds_fault(far_scene(random)), "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus::test
