#include "core/query/kinds/nearest_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Returns a world with the instances 4 and 5 of a mesh whose walls are at x = 0, 10 and 20, and with objects at x = -4,
// -2 and 6. Instance 5 is displaced by 3 along x.
QueryWorld mixed_world() {
  QueryWorld world;
  const StaticMeshPtr walls = mesh_of({wall_triangle(0), wall_triangle(10), wall_triangle(20)});
  world.instances = {placed(4, walls), placed(5, walls, {3, 0, 0})};
  world.objects = {ball_object(9, {-4, 0, 0}), box_object(2, {6, 0, 0}), point_object(7, {-2, 0, 0})};
  return world;
}

TEST(NearestQueryTest, CountIsOneByDefault) {
  const BlockResult result = run_block(*snapshot_of(mixed_world()), one_point({-1.75, 0, 0}));
  EXPECT_THAT(result.counts, ElementsAre(1));
  EXPECT_THAT(result.ids, ElementsAre(7));
  EXPECT_THAT(result.t, ElementsAre(0.25f));
  EXPECT_THAT(result.triangles, ElementsAre(kNoTriangle));
}

TEST(NearestQueryTest, RowsAscendByDistanceOverInstancesAndObjects) {
  const BlockResult result = run_block(*snapshot_of(mixed_world()), one_point({-1, 0, 0}, 100));
  EXPECT_THAT(result.counts, ElementsAre(5));
  EXPECT_THAT(result.ids, ElementsAre(4, 7, 9, 5, 2));
  EXPECT_THAT(result.t, ElementsAre(1, 1, 2, 4, 6));
  EXPECT_THAT(result.triangles, ElementsAre(0, kNoTriangle, kNoTriangle, 0, kNoTriangle));
  EXPECT_THAT(result.truncated, IsEmpty());
}

TEST(NearestQueryTest, AnInstanceIsOneRowWithItsNearestTriangle) {
  OwnedBlock block = one_point({18, 0, 0}, 100);
  block.settings.source = Source::kStatic;
  const BlockResult result = run_block(*snapshot_of(mixed_world()), block);
  EXPECT_THAT(result.ids, ElementsAre(4, 5));
  EXPECT_THAT(result.t, ElementsAre(2, 5));
  EXPECT_THAT(result.triangles, ElementsAre(2, 1));
}

TEST(NearestQueryTest, EachTriangleIsARowByDistanceSortedOrNot) {
  for (const StaticDetail detail : {StaticDetail::kTriangles, StaticDetail::kTrianglesSorted}) {
    OwnedBlock block = one_point({11, 0, 0}, 100, detail);
    block.settings.source = Source::kStatic;
    const BlockResult result = run_block(*snapshot_of(mixed_world()), block);
    EXPECT_THAT(result.ids, ElementsAre(4, 5, 5, 4, 4, 5));
    EXPECT_THAT(result.t, ElementsAre(1, 2, 8, 9, 11, 12));
    EXPECT_THAT(result.triangles, ElementsAre(1, 1, 0, 2, 0, 2));
  }
}

TEST(NearestQueryTest, AtEqualDistanceTheLowerIdAndThenTheLowerTriangleComesFirst) {
  QueryWorld world;
  world.instances = {placed(5, mesh_of({wall_triangle(1), wall_triangle(-1), wall_triangle(1)}))};
  world.objects = {point_object(9, {0, 1, 0}), point_object(3, {0, 0, -1})};
  const SnapshotPtr snapshot = snapshot_of(world);
  const BlockResult all = run_block(*snapshot, one_point({}, 9, StaticDetail::kTriangles));
  EXPECT_THAT(all.ids, ElementsAre(3, 5, 5, 5, 9));
  EXPECT_THAT(all.triangles, ElementsAre(kNoTriangle, 0, 1, 2, kNoTriangle));
  const BlockResult two = run_block(*snapshot, one_point({}, 2, StaticDetail::kTriangles));
  EXPECT_THAT(two.ids, ElementsAre(3, 5));
  EXPECT_THAT(two.triangles, ElementsAre(kNoTriangle, 0));
  EXPECT_THAT(run_block(*snapshot, one_point({}, 9)).triangles, ElementsAre(kNoTriangle, 0, kNoTriangle));
}

TEST(NearestQueryTest, MaxDistanceIsIncluded) {
  const SnapshotPtr snapshot = snapshot_of(mixed_world());
  OwnedBlock block = one_point({-1, 0, 0}, 100);
  block.extras = {4};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(4, 7, 9, 5));
  block.extras = {std::nextafter(4.0f, 0.0f)};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(4, 7, 9));
  block.extras = {0};
  EXPECT_THAT(run_block(*snapshot, block).counts, ElementsAre(0));
  block.extras = {std::numeric_limits<float>::infinity()};
  EXPECT_THAT(run_block(*snapshot, block).ids, ElementsAre(4, 7, 9, 5, 2));
}

TEST(NearestQueryTest, EachQueryHasItsOwnMaxDistance) {
  OwnedBlock block = one_point({-1, 0, 0}, 100);
  block.points.insert(block.points.end(), {-1, 0, 0});
  block.extras = {1, 2};
  const BlockResult result = run_block(*snapshot_of(mixed_world()), block);
  EXPECT_THAT(result.counts, ElementsAre(2, 3));
}

TEST(NearestQueryTest, APointInASolidOrOnASurfaceHasDistanceZeroAndIsItsOwnNearestPoint) {
  QueryWorld world;
  world.objects = {ball_object(1, {1, 2, 3}), box_object(2, {2, 2, 3})};
  world.instances = {placed(4, wall_mesh(), {1.5, 2, 3})};
  OwnedBlock block = one_point({1.5, 2, 3}, 9);
  block.settings.columns = {Column::kT, Column::kId, Column::kPoint};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.ids, ElementsAre(1, 2, 4));
  EXPECT_THAT(result.t, ElementsAre(0, 0, 0));
  EXPECT_THAT(result.points, ElementsAre(1.5, 2, 3, 1.5, 2, 3, 1.5, 2, 3));
}

TEST(NearestQueryTest, TheNormalOfAPointOnATriangleIsThatOfTheFrontByTheWindingOfTheScene) {
  QueryWorld world;
  world.instances = {placed(4, mesh_of({wall_triangle(5)}))};
  OwnedBlock block = one_point({5, 0, 0});
  block.settings.columns = {Column::kT, Column::kNormal};
  world.winding = Winding::kCounterClockwise;
  const BlockResult counter = run_block(*snapshot_of(world), block);
  world.winding = Winding::kClockwise;
  const BlockResult clockwise = run_block(*snapshot_of(world), block);
  EXPECT_THAT(counter.t, ElementsAre(0));
  EXPECT_THAT(clockwise.normals, ElementsAre(-counter.normals[0], 0, 0));
  EXPECT_EQ(std::abs(counter.normals[0]), 1);
  // The normal is on the front side of the triangle: a ray with Cull::kBack that starts on this side hits the triangle.
  OwnedBlock ray = one_ray(RayMode::kFirst, {5 + clockwise.normals[0], 0, 0}, {-clockwise.normals[0], 0, 0});
  rays_of(ray).cull = Cull::kBack;
  EXPECT_THAT(run_block(*snapshot_of(world), ray).t, ElementsAre(1));
}

TEST(NearestQueryTest, PointsAreOnTheSurfaceRelativeToTheFrame) {
  QueryWorld world;
  world.objects = {ball_object(1, {1e6 + 3, 4, 0}, 4), box_object(2, {1e6 - 5, 0, 0})};
  world.instances = {placed(4, wall_mesh(), {1e6 + 8, 0, 0})};
  OwnedBlock block = one_point({0, 0, 0}, 9);
  block.settings.frame = {1e6, 0, 0};
  block.settings.columns = {Column::kT, Column::kId, Column::kPoint};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.ids, ElementsAre(1, 2, 4));
  EXPECT_THAT(result.t, ElementsAre(1, 4, 8));
  ASSERT_EQ(result.points.size(), 9u);
  EXPECT_FLOAT_EQ(result.points[0], 0.6f);
  EXPECT_FLOAT_EQ(result.points[1], 0.8f);
  EXPECT_THAT(std::vector<float>(result.points.begin() + 2, result.points.end()), ElementsAre(0, -4, 0, 0, 8, 0, 0));
}

TEST(NearestQueryTest, DistancesToScaledInstancesAreInWorldUnits) {
  QueryWorld world;
  PlacedMesh wall = placed(4, wall_mesh(), {10, 0, 0});
  wall.scale = 8;
  wall.rotation = {0, 0, 0.70710678f, 0.70710678f};  // the wall's plane is now y = 0
  world.instances = {wall};
  const BlockResult result = run_block(*snapshot_of(world), one_point({10, 24, 0}));
  ASSERT_EQ(result.t.size(), 1u);
  EXPECT_NEAR(result.t[0], 24, 1e-5);
}

TEST(NearestQueryTest, ConservativeDistancesAreToBounds) {
  QueryWorld world;
  world.objects = {ball_object(1, {5, 5, 0}, 4)};
  world.instances = {placed(4, mesh_of({{{8, 0, 0}, {0, 8, 0}, {8, 8, 0}}}))};
  OwnedBlock block = one_point({0, 0, 0}, 9);
  block.settings.precision = Precision::kConservative;
  block.settings.columns = {Column::kT, Column::kId, Column::kPoint};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.ids, ElementsAre(4, 1));
  EXPECT_EQ(result.t[0], 0);
  EXPECT_NEAR(result.t[1], std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(result.points[3], 1, 1e-6);
  EXPECT_NEAR(result.points[4], 1, 1e-6);
  EXPECT_EQ(result.points[5], 0);
}

TEST(NearestQueryTest, FiltersSkipNearerRows) {
  QueryWorld world;
  for (Id id = 1; id <= 4; ++id) world.objects.push_back(point_object(id, {static_cast<double>(id), 0, 0}));
  world.objects[0].layers = 2;
  world.objects[1].group = 7;
  OwnedBlock block = one_point({});
  block.masks = {1};
  block.ignore_groups = {7};
  block.ignore_ids = {3};
  EXPECT_THAT(run_block(*snapshot_of(world), block).ids, ElementsAre(4));
}

TEST(NearestQueryTest, SourceAndLabelColumnsWorkAsForOtherKinds) {
  QueryWorld world = mixed_world();
  world.objects[2].tag = 99;
  OwnedBlock block = one_point({-1, 0, 0}, 9);
  block.settings.source = Source::kDynamic;
  block.settings.columns = {Column::kId, Column::kTag, Column::kPose};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.ids, ElementsAre(7, 9, 2));
  EXPECT_THAT(result.tags, ElementsAre(99, 0, 0));
  EXPECT_THAT(result.positions, ElementsAre(-2, 0, 0, -4, 0, 0, 6, 0, 0));
  EXPECT_THAT(result.t, IsEmpty());
}

TEST(NearestQueryTest, MaxResultsAndAfterIdAreIgnored) {
  OwnedBlock block = one_point({-1, 0, 0}, 3);
  block.settings.max_results = 1;
  block.settings.after_id = 1000;
  const BlockResult result = run_block(*snapshot_of(mixed_world()), block);
  EXPECT_THAT(result.ids, ElementsAre(4, 7, 9));
  EXPECT_THAT(result.truncated, IsEmpty());
}

TEST(NearestQueryTest, AnEmptySceneGivesNoRows) {
  const BlockResult result = run_block(*snapshot_of({}), one_point({1, 2, 3}, 5));
  EXPECT_THAT(result.counts, ElementsAre(0));
  EXPECT_THAT(result.ids, IsEmpty());
}

TEST(NearestQueryTest, TrianglesWithoutAreaAreFound) {
  QueryWorld world;
  world.instances = {placed(4, mesh_of({{{3, 0, 0}, {3, 0, 0}, {3, 0, 0}}, {{0, 4, 0}, {8, 4, 0}, {4, 4, 0}}}))};
  const BlockResult result = run_block(*snapshot_of(world), one_point({}, 2, StaticDetail::kTriangles));
  EXPECT_THAT(result.t, ElementsAre(3, 4));
  EXPECT_THAT(result.triangles, ElementsAre(0, 1));
}

TEST(NearestQueryTest, FewTrianglesOfALargeMeshAreTested) {
  Random random(71);
  std::vector<Triangle> triangles;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3d at = random.vector(100);
    triangles.push_back({to_float(at), to_float(at + random.vector(1)), to_float(at + random.vector(1)), 0});
  }
  QueryWorld world;
  world.instances = {placed(4, mesh_of(triangles))};
  const BlockResult result = run_block(*snapshot_of(world), one_point({1, 2, 3}, 4, StaticDetail::kTriangles));
  EXPECT_THAT(result.counts, ElementsAre(4));
  EXPECT_LE(result.work.tests, 200u);
}

TEST(NearestQueryTest, ConservativeDistanceAndPointBelongToTheSameBoundsFarFromTheOrigin) {
  for (const double away : {0.0, 1e3, 1e6, 1e9 - 100}) {
    QueryWorld world;
    PlacedMesh cube = placed(4, cube_mesh(), {away, away, -away});
    cube.rotation = {0, 0, 0.70710678f, 0.70710678f};
    world.instances = {cube};
    OwnedBlock block = one_point({-4, 5, 0.5f}, 1, StaticDetail::kTriangles);
    block.settings.frame = {away, away, -away};
    block.settings.precision = Precision::kConservative;
    block.settings.columns = {Column::kT, Column::kPoint};
    const BlockResult result = run_block(*snapshot_of(world), block);
    ASSERT_EQ(result.t.size(), 1u);
    EXPECT_NEAR(result.t[0], 5, std::max(1e-6, away * 0x1p-39)) << away;
    const double x = -4 - double{result.points[0]}, y = 5 - double{result.points[1]},
                 z = 0.5 - double{result.points[2]};
    EXPECT_NEAR(std::sqrt(x * x + y * y + z * z), result.t[0], 1e-6) << away;
  }
}

}  // namespace
}  // namespace locus::test
