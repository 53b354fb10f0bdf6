#include "core/index/bvh/triangle_bvh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/index/bvh/bvh.h"
#include "core/index/queries/index_queries.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/scene_search.h"

namespace locus::test {
namespace {

static_assert(SpatialIndex<TriangleBvh>);

TriangleBvh build(const std::vector<Triangle>& triangles, int bins = 32) {
  BvhOptions options;
  options.bins = bins;
  absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(triangles, options);
  EXPECT_TRUE(tree.ok()) << tree.status();
  return tree.ok() ? *std::move(tree) : TriangleBvh();
}

std::vector<Triangle> in_storage_order(const TriangleBvh& tree) {
  std::vector<Triangle> triangles;
  tree.for_each([&](const Triangle& triangle) { triangles.push_back(triangle); });
  return triangles;
}

std::string difference_from_list(const TestScene<Triangle>& scene) {
  const ListIndex<Triangle> oracle = make_list(scene.values);
  const TriangleBvh tree = build(scene.values, 2 + static_cast<int>(scene.values.size() % 31));
  return IndexJudge<TriangleBvh>(tree, oracle).difference(scene);
}

TEST(TriangleBvhTest, AnEmptyTreeAnswersNothing) {
  const TriangleBvh tree = build({});
  EXPECT_EQ(tree.size(), 0u);
  EXPECT_TRUE(tree.bounds().empty());
  EXPECT_EQ(tree.sah_cost(), 0);
  EXPECT_FALSE(any_ray(tree, TriangleRay({0, 0, 0}, {1, 0, 0}), std::numeric_limits<float>::infinity()));
  std::vector<Triangle> found;
  ball_overlap(tree, {{0, 0, 0}, 1e9f}, found);
  EXPECT_TRUE(found.empty());
}

TEST(TriangleBvhTest, AnswersAsTheListDoesOnRandomScenes) {
  EXPECT_EQ(search_all_scenes<Triangle>(scaled_count(2'000), 0, difference_from_list), "");
}

TEST(TriangleBvhTest, AnswersAsTheListDoesOnAdversarialScenes) {
  EXPECT_EQ(search_all_scenes<Triangle>(0, scaled_count(600), difference_from_list), "");
}

TEST(TriangleBvhTest, KeepsEveryTriangleAsItIs) {
  const std::vector<Triangle> triangles = box_city(5, 1);
  const TriangleBvh tree = build(triangles);
  EXPECT_THAT(in_storage_order(tree), ::testing::UnorderedElementsAreArray(triangles));
  EXPECT_EQ(tree.size(), triangles.size());
}

TEST(TriangleBvhTest, AtReturnsTheTriangleAtAStoragePosition) {
  const TriangleBvh tree = build(bumpy_sphere(9, 0.1, 2));
  const std::vector<Triangle> stored = in_storage_order(tree);
  for (size_t position = 0; position < stored.size(); ++position) ASSERT_EQ(tree.at(position), stored[position]);
}

TEST(TriangleBvhTest, RegionsAreVisitedInStorageOrder) {
  const TriangleBvh tree = build(bumpy_sphere(12, 0.1, 4));
  std::vector<Triangle> found;
  ball_overlap(tree, {{0, 0, 0}, 9}, found);
  EXPECT_EQ(found, in_storage_order(tree));
}

TEST(TriangleBvhTest, ChildrenAreSortedByAreaAndOrdersContainEverySlotOnce) {
  const TriangleBvh built = build(box_city(12, 3));
  const TriangleTree tree = built.tree();
  for (size_t number = 0; number < built.node_count(); ++number) {
    const TriangleNode& node = tree.nodes[number];
    float area = 0;
    for (int slot = 0; slot < kTreeWidth && node.child[slot] != kNoChild; ++slot) {
      const Aabbf box = {{node.bounds[0][slot], node.bounds[1][slot], node.bounds[2][slot]},
                         {node.bounds[3][slot], node.bounds[4][slot], node.bounds[5][slot]}};
      ASSERT_GE(half_area(box), area);
      area = half_area(box);
    }
    for (const uint32_t order : node.order) {
      uint32_t slots = 0;
      for (int rank = 0; rank < kTreeWidth; ++rank) slots |= 1u << (order >> (3 * rank) & 7u);
      ASSERT_EQ(slots, 255u);
    }
  }
}

TEST(TriangleBvhTest, TheRangeOfANodeIsTheRangesOfItsBlocksThenOfItsNodes) {
  const TriangleBvh built = build(box_city(12, 3));
  const TriangleTree tree = built.tree();
  EXPECT_EQ(tree.ranges[0].count, built.size());
  for (size_t number = 0; number < built.node_count(); ++number) {
    uint32_t next = tree.ranges[number].first;
    for (const uint32_t kind : {kBlockBit, uint32_t{0}}) {
      for (const uint32_t child : tree.nodes[number].child) {
        if (child == kNoChild || (child & kBlockBit) != kind) continue;
        const bool is_block = kind == kBlockBit;
        ASSERT_EQ(is_block ? tree.blocks[child & ~kBlockBit].first : tree.ranges[child].first, next);
        next += is_block ? tree.blocks[child & ~kBlockBit].count : tree.ranges[child].count;
      }
    }
    ASSERT_EQ(next, tree.ranges[number].first + tree.ranges[number].count);
  }
}

// Bvh and TriangleBvh have the same builder; bvh_test.cc tests the cost of a Bvh.
TEST(TriangleBvhTest, CostsTheSameAsABvhOfTheTriangles) {
  const std::vector<Triangle> triangles = bumpy_sphere(64, 0.02, 1);
  const absl::StatusOr<Bvh<Triangle>> values = Bvh<Triangle>::build(triangles);
  ASSERT_TRUE(values.ok());
  const TriangleBvh tree = build(triangles);
  EXPECT_EQ(tree.node_count(), values->node_count());
  EXPECT_NEAR(tree.sah_cost(), values->sah_cost(), 1e-6 * values->sah_cost());
}

TEST(TriangleBvhTest, TakesAtMost95BytesATriangle) {
  const std::vector<Triangle> triangles = bumpy_sphere(64, 0.02, 1);
  EXPECT_LE(build(triangles).bytes(), 95 * triangles.size());
}

TEST(TriangleBvhTest, ErrorsOfTheBuildArePassedOn) {
  std::vector<Triangle> triangles = bumpy_sphere(4, 0, 1);
  triangles[5].b.y = std::numeric_limits<float>::infinity();
  EXPECT_EQ(TriangleBvh::build(triangles).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace locus::test
