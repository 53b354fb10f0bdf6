#include "core/query/kinds/overlap_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Returns a mesh of ten walls of one triangle each: triangle n is at x = 7 * n mod 10.
StaticMeshPtr ten_walls() {
  std::vector<Triangle> walls;
  for (int i = 0; i < 10; ++i) walls.push_back(wall_triangle(static_cast<float>(7 * i % 10)));
  return mesh_of(walls);
}

QueryWorld walls_and_solids() {
  QueryWorld world;
  world.instances = {placed(4, ten_walls()), placed(kFirstChosenId | 1, ten_walls())};
  world.objects = {ball_object(9, {0, 0, 0}), ball_object(2, {1, 0, 0}), box_object(6, {2, 0, 0})};
  return world;
}

TEST(OverlapQueryTest, RowsAscendByIdOverInstancesAndObjects) {
  const SnapshotPtr snapshot = snapshot_of(walls_and_solids());
  for (const OwnedBlock& block : {one_ball({0, 0, 0}, 4), one_box({0, 0, 0}, {4, 4, 4})}) {
    const BlockResult result = run_block(*snapshot, block);
    EXPECT_THAT(result.counts, ElementsAre(5));
    EXPECT_THAT(result.ids, ElementsAre(2, 4, 6, 9, kFirstChosenId | 1));
    EXPECT_THAT(result.triangles, IsEmpty());
  }
}

TEST(OverlapQueryTest, AnInstanceIsOneRowForAnyNumberOfTrianglesFound) {
  OwnedBlock block = one_ball({0, 0, 0}, 100);
  block.settings.columns = {Column::kId, Column::kTriangle};
  block.settings.source = Source::kStatic;
  const BlockResult result = run_block(*snapshot_of(walls_and_solids()), block);
  EXPECT_THAT(result.ids, ElementsAre(4, kFirstChosenId | 1));
  EXPECT_THAT(result.triangles, ElementsAre(kNoTriangle, kNoTriangle));
}

TEST(OverlapQueryTest, TrianglesAreInStorageOrder) {
  const SnapshotPtr snapshot = snapshot_of(walls_and_solids());
  OwnedBlock block = one_ball({0, 0, 0}, 100, StaticDetail::kTriangles);
  block.settings.source = Source::kStatic;
  const BlockResult result = run_block(*snapshot, block);
  std::vector<uint32_t> storage;
  snapshot->statics->find(4)->mesh->tree().for_each(
      [&](const Triangle& triangle) { storage.push_back(triangle.number); });
  ASSERT_EQ(result.triangles.size(), 20u);
  EXPECT_THAT(std::vector<uint32_t>(result.triangles.begin(), result.triangles.begin() + 10),
              ::testing::ElementsAreArray(storage));
  EXPECT_THAT(std::vector<uint32_t>(result.triangles.begin() + 10, result.triangles.end()),
              ::testing::ElementsAreArray(storage));
}

TEST(OverlapQueryTest, SortedTrianglesAscend) {
  OwnedBlock block = one_box({5, 0, 0}, {1.5f, 1, 1}, StaticDetail::kTrianglesSorted);
  const BlockResult result = run_block(*snapshot_of(walls_and_solids()), block);
  EXPECT_THAT(result.ids, ElementsAre(4, 4, 4, kFirstChosenId | 1, kFirstChosenId | 1, kFirstChosenId | 1));
  EXPECT_THAT(result.triangles, ElementsAre(2, 5, 8, 2, 5, 8));  // the triangles at x = 4, 5 and 6
}

TEST(OverlapQueryTest, ObjectsAreOneRowAmongTriangles) {
  const OwnedBlock block = one_box({2, 0, 0}, {0.25f, 0.25f, 0.25f}, StaticDetail::kTrianglesSorted);
  const BlockResult result = run_block(*snapshot_of(walls_and_solids()), block);
  EXPECT_THAT(result.ids, ElementsAre(2, 4, 6, kFirstChosenId | 1));
  EXPECT_THAT(result.triangles, ElementsAre(kNoTriangle, 6, kNoTriangle, 6));
}

TEST(OverlapQueryTest, TouchingCounts) {
  QueryWorld world;
  world.objects = {ball_object(1, {5, 0, 0}), box_object(2, {-5, 0, 0}), point_object(3, {0, 4, 0})};
  world.instances = {placed(4, wall_mesh(), {4, 0, 0})};
  const SnapshotPtr snapshot = snapshot_of(world);
  EXPECT_THAT(run_block(*snapshot, one_ball({0, 0, 0}, 4)).ids, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(run_block(*snapshot, one_ball({0, 0, 0}, std::nextafter(4.0f, 0.0f))).ids, IsEmpty());
  EXPECT_THAT(run_block(*snapshot, one_box({0, 0, 0}, {4, 4, 4})).ids, ElementsAre(1, 2, 3, 4));
  const float less = std::nextafter(4.0f, 0.0f);
  EXPECT_THAT(run_block(*snapshot, one_box({0, 0, 0}, {less, less, less})).ids, IsEmpty());
}

TEST(OverlapQueryTest, ZeroRadiusAndZeroExtentFindWhatContainsThePoint) {
  QueryWorld world;
  world.objects = {ball_object(1, {5, 0, 0}), point_object(2, {4, 0, 0}), box_object(3, {9, 0, 0})};
  world.instances = {placed(4, wall_mesh(), {4, 0, 0})};
  const SnapshotPtr snapshot = snapshot_of(world);
  EXPECT_THAT(run_block(*snapshot, one_ball({4, 0, 0}, 0)).ids, ElementsAre(1, 2, 4));
  EXPECT_THAT(run_block(*snapshot, one_box({4, 0, 0}, {0, 0, 0})).ids, ElementsAre(1, 2, 4));
}

TEST(OverlapQueryTest, StaticTrianglesAreSurfaces) {
  QueryWorld world;
  world.instances = {placed(1, mesh_of({wall_triangle(-4), wall_triangle(4)}))};
  EXPECT_THAT(run_block(*snapshot_of(world), one_ball({0, 0, 0}, 1)).ids, IsEmpty());
}

TEST(OverlapQueryTest, RotatedBoxesReachFarthestAtTheirCorners) {
  QueryWorld world;
  world.objects = {point_object(1, {1.4, 0, 0}), point_object(2, {0.99, 0.99, 0})};
  OwnedBlock block = one_box({0, 0, 0}, {1, 1, 1});
  const SnapshotPtr snapshot = snapshot_of(world);
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(2));
  block.extras = {0, 0, std::sin(0.39269908f), std::cos(0.39269908f)};  // 45 degrees about z
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(1));
  block.settings.precision = Precision::kConservative;
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(1, 2));
}

TEST(OverlapQueryTest, MaxResultsKeepsTheLowestIds) {
  QueryWorld world;
  for (Id id = 50; id > 0; --id) world.objects.push_back(ball_object(id, {double(50 - id) / 10, 0, 0}));
  world.instances = {placed(51, wall_mesh()), placed(100, wall_mesh())};
  for (const uint32_t most : {1u, 7u, 51u}) {
    OwnedBlock block = one_ball({0, 0, 0}, 50);
    block.settings.max_results = most;
    const BlockResult result = run_block(*snapshot_of(world), block);
    ASSERT_EQ(result.ids.size(), most);
    for (uint32_t i = 0; i < most; ++i) EXPECT_EQ(result.ids[i], i + 1);
    EXPECT_THAT(result.truncated, ElementsAre(0));
  }
  OwnedBlock block = one_ball({0, 0, 0}, 50);
  block.settings.max_results = 52;
  EXPECT_THAT(run_block(*snapshot_of(world), block).truncated, IsEmpty());
}

TEST(OverlapQueryTest, MaxResultsHasADefault) {
  QueryWorld world;
  for (Id id = 1; id <= 1025; ++id) world.objects.push_back(ball_object(id, {0, 0, 0}));
  const BlockResult result = run_block(*snapshot_of(world), one_ball({0, 0, 0}, 1));
  EXPECT_THAT(result.counts, ElementsAre(1024));
  EXPECT_THAT(result.truncated, ElementsAre(0));
}

TEST(OverlapQueryTest, PagingByAfterIdGivesTheRowsOfOneLargeQuery) {
  QueryWorld world;
  for (Id id = 1; id <= 100; ++id) {
    if (id % 3 == 0) world.instances.push_back(placed(id * 7, wall_mesh()));
    if (id % 3 != 0) world.objects.push_back(ball_object(id * 7, {0, 0, 0}));
  }
  const SnapshotPtr snapshot = snapshot_of(world);
  for (OwnedBlock block : {one_ball({0, 0, 0}, 1), one_box({0, 0, 0}, {1, 1, 1})}) {
    const std::vector<uint64_t> whole = run_block(*snapshot, block).ids;
    block.settings.max_results = 9;
    std::vector<uint64_t> pages;
    for (bool more = true; more;) {
      const BlockResult page = run_block(*snapshot, block);
      pages.insert(pages.end(), page.ids.begin(), page.ids.end());
      more = !page.truncated.empty();
      block.settings.after_id = pages.back();
    }
    EXPECT_EQ(pages, whole);
    EXPECT_EQ(whole.size(), 100u);
  }
}

TEST(OverlapQueryTest, SourceRestrictsTheSearchToStaticOrDynamic) {
  const SnapshotPtr snapshot = snapshot_of(walls_and_solids());
  OwnedBlock block = one_ball({0, 0, 0}, 4);
  block.settings.source = Source::kStatic;
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(4, kFirstChosenId | 1));
  block.settings.source = Source::kDynamic;
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(2, 6, 9));
}

TEST(OverlapQueryTest, MasksFindObjectsThatShareALayer) {
  QueryWorld world;
  world.objects = {ball_object(1, {}), ball_object(2, {}), ball_object(3, {})};
  world.instances = {placed(4, wall_mesh()), placed(5, wall_mesh())};
  world.objects[1].layers = 6;
  world.objects[2].layers = 0;
  world.instances[1].layers = 4;
  const SnapshotPtr snapshot = snapshot_of(world);
  OwnedBlock block = one_ball({}, 1);
  block.points.assign(9, 0);
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(1, 2, 4, 5, 1, 2, 4, 5, 1, 2, 4, 5)) << "0 is hidden";
  block.masks = {1, 4, 0};
  const BlockResult result = run_block(*snapshot, block);
  EXPECT_THAT(result.counts, ElementsAre(2, 2, 0));
  EXPECT_THAT(result.ids, ElementsAre(1, 4, 2, 5));
  block.masks = {2};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(2, 2, 2));
}

TEST(OverlapQueryTest, OneGroupPerQueryAndUpTo64IdsPerBlockAreIgnored) {
  QueryWorld world;
  world.objects = {ball_object(1, {}), ball_object(2, {}), ball_object(3, {})};
  world.instances = {placed(4, wall_mesh())};
  world.objects[0].group = world.instances[0].group = 8;
  world.objects[1].group = 9;
  const SnapshotPtr snapshot = snapshot_of(world);
  OwnedBlock block = one_ball({}, 1);
  block.points.assign(9, 0);
  block.ignore_groups = {8, 9, 0};
  const BlockResult result = run_block(*snapshot, block);
  EXPECT_THAT(result.counts, ElementsAre(2, 3, 4)) << "group 0 means no group";
  EXPECT_THAT(result.ids, ElementsAre(2, 3, 1, 3, 4, 1, 2, 3, 4));
  block.ignore_groups = {8};
  block.ignore_ids = {77, 3};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(2, 2, 2));
}

TEST(OverlapQueryTest, AQueryFindsOnlySomeGroupsOneTagAndNotItself) {
  QueryWorld world;
  world.objects = {ball_object(1, {}), ball_object(2, {}), ball_object(3, {})};
  world.instances = {placed(4, wall_mesh())};
  world.objects[0].group = world.instances[0].group = 8;
  world.objects[1].group = 9;
  world.objects[0].tag = 0x15;
  world.objects[1].tag = 0x25;
  world.instances[0].tag = 0x8000000000000005;
  const SnapshotPtr snapshot = snapshot_of(world);
  OwnedBlock all = one_ball({}, 1);
  all.points.assign(9, 0);
  OwnedBlock block = all;
  block.settings.only_groups_each = 2;
  block.only_groups = {8, 9, 0, 9, 0, 0};
  BlockResult result = run_block(*snapshot, block);
  EXPECT_THAT(result.counts, ElementsAre(3, 1, 4)) << "0 fills an entry and matches no object without a group";
  EXPECT_THAT(result.ids, ElementsAre(1, 2, 4, 2, 1, 2, 3, 4));
  block.ignore_groups = {8};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(2, 2, 2, 3)) << "both filters apply";
  block = all;
  block.tags = {0x15, 0x5, 0xFF};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(1));
  block.tag_masks = {0xFF, 0xF, 0};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(1, 1, 2, 4, 1, 2, 3, 4))
      << "bits outside of a mask do not count";
  block = all;
  block.self_ids = {4, 77, 0};
  EXPECT_THAT(run_block(*snapshot, block).counts, ElementsAre(3, 4, 4));
  block.self_ids = {2};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(1, 3, 4, 1, 3, 4, 1, 3, 4));
}

TEST(OverlapQueryTest, InstancesAreFoundAtTheirScaleAndPosition) {
  QueryWorld world;
  PlacedMesh instance = placed(1, wall_mesh(), {1e6, -1e6, 5});
  for (const float scale : {1e-3f, 1.0f, 1e3f}) {
    instance.scale = scale;
    world.instances = {instance};
    OwnedBlock block = one_ball({2 * scale, 0, 0}, 2.001f * scale);
    block.settings.frame = instance.translation;
    EXPECT_THAT(run_block(*snapshot_of(world), block).ids, ElementsAre(1)) << scale;
    block.sizes = {1.99f * scale};
    EXPECT_THAT(run_block(*snapshot_of(world), block).ids, IsEmpty()) << scale;
  }
}

TEST(OverlapQueryTest, ConservativeRotatedQueryBoxesCountAsTheirAxisAlignedBounds) {
  QueryWorld world;
  world.objects = {point_object(1, {1.41, 1.41, 0.9}), point_object(2, {1.42, 0, 0})};
  world.instances = {placed(3, mesh_of({{{1.4f, 1.4f, 0}, {2, 1.4f, 0}, {1.4f, 2, 0}}})),
                     placed(4, mesh_of({{{1.42f, 0, 0}, {2, 0, 0}, {2, 1, 0}}}))};
  OwnedBlock block = one_box({0, 0, 0}, {1, 1, 1});
  block.extras = {0, 0, std::sin(0.39269908f), std::cos(0.39269908f)};  // 45 degrees about z
  EXPECT_THAT(run_block(*snapshot_of(world), block).ids, IsEmpty());
  block.settings.precision = Precision::kConservative;
  EXPECT_THAT(run_block(*snapshot_of(world), block).ids, ElementsAre(1, 3));
}

TEST(OverlapQueryTest, ConservativeBallsAreTestedAsBallsAgainstBounds) {
  QueryWorld world;
  world.objects = {ball_object(1, {1.6, 1.6, 0}, 1), ball_object(2, {1.75, 1.75, 0}, 1)};
  world.instances = {placed(3, mesh_of({{{0.6f, 0.9f, 0}, {0.9f, 0.6f, 0}, {0.9f, 0.9f, 0}}})),
                     placed(4, mesh_of({{{0.75f, 0.75f, 0}, {0.9f, 0.75f, 0}, {0.75f, 0.9f, 0}}}))};
  OwnedBlock block = one_ball({0, 0, 0}, 1);
  EXPECT_THAT(run_block(*snapshot_of(world), block).ids, IsEmpty());
  block.settings.precision = Precision::kConservative;
  EXPECT_THAT(run_block(*snapshot_of(world), block).ids, ElementsAre(1, 3));
}

TEST(OverlapQueryTest, ConservativeRegionsFindTheSameFarFromTheOriginAsNearIt) {
  for (const double away : {0.0, 1e3, 1e6, 1e9 - 100}) {
    QueryWorld world;
    world.instances = {placed(4, mesh_of({wall_triangle(1), wall_triangle(8)}), {away, 0, -away})};
    OwnedBlock blocks[] = {one_ball({3, 0, 0}, 2), one_ball({3, 0, 0}, 1.99f), one_box({3, 0, 0}, {2, 1, 1}),
                           one_box({3, 0, 0}, {1.99f, 1, 1})};
    std::vector<size_t> found;
    for (OwnedBlock& block : blocks) {
      block.settings.frame = {away, 0, -away};
      block.settings.precision = Precision::kConservative;
      found.push_back(run_block(*snapshot_of(world), block).ids.size());
    }
    EXPECT_THAT(found, ElementsAre(1, 0, 1, 0)) << away;
  }
}

}  // namespace
}  // namespace locus::test
