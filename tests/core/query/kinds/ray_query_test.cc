#include "core/query/kinds/ray_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/small_world.h"
#include "tests/support/special_floats.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(RayQueryTest, AMissIsARowWithInfiniteTAndZeros) {
  OwnedBlock block = rays_along_x(RayMode::kFirst);
  for (int number = 1; number <= 10; ++number) block.settings.columns.add(static_cast<Column>(number));
  const BlockResult result = run_block(*snapshot_of({}), block);
  EXPECT_THAT(result.t, ElementsAre(kInfinity));
  EXPECT_THAT(result.ids, ElementsAre(0));
  EXPECT_THAT(result.triangles, ElementsAre(0xFFFFFFFFu));
  EXPECT_THAT(result.uvs, ElementsAre(0, 0));
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 0));
  EXPECT_THAT(result.points, ElementsAre(0, 0, 0));
  EXPECT_THAT(result.groups, ElementsAre(0));
  EXPECT_THAT(result.tags, ElementsAre(0));
  EXPECT_THAT(result.layers, ElementsAre(0));
  EXPECT_THAT(result.positions, ElementsAre(0, 0, 0));
  EXPECT_THAT(result.rotations, ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(result.counts, IsEmpty());
}

TEST(RayQueryTest, FirstIsDenseWithMissesBetweenHits) {
  QueryWorld world;
  world.objects = {ball_object(7, {5, 0, 0})};
  const BlockResult result = run_block(*snapshot_of(world), rays_along_x(RayMode::kFirst, {0, 0, 0, 0, 9, 0, 2, 0, 0}));
  EXPECT_THAT(result.t, ElementsAre(4, kInfinity, 2));
  EXPECT_THAT(result.ids, ElementsAre(7, 0, 7));
  EXPECT_THAT(result.triangles, ElementsAre(kNoTriangle, kNoTriangle, kNoTriangle));
}

TEST(RayQueryTest, AnyIsOneBytePerRay) {
  QueryWorld world;
  world.objects = {ball_object(7, {5, 0, 0})};
  const BlockResult result = run_block(*snapshot_of(world), rays_along_x(RayMode::kAny, {0, 0, 0, 0, 9, 0, 2, 0, 0}));
  EXPECT_EQ(result.hits, std::string("\1\0\1", 3));
  EXPECT_THAT(result.t, IsEmpty());
  EXPECT_THAT(result.ids, IsEmpty());
  EXPECT_THAT(result.counts, IsEmpty());
}

TEST(RayQueryTest, AllIsSortedOverObjectsAndInstances) {
  QueryWorld world;
  world.objects = {ball_object(1, {9, 0, 0}), ball_object(2, {3, 0, 0})};
  world.instances = {placed(3, mesh_of({wall_triangle(6), wall_triangle(1)}))};
  const BlockResult result = run_block(*snapshot_of(world), rays_along_x(RayMode::kAll));
  EXPECT_THAT(result.counts, ElementsAre(4));
  EXPECT_THAT(result.t, ElementsAre(1, 2, 6, 8));
  EXPECT_THAT(result.ids, ElementsAre(3, 2, 3, 1));
  EXPECT_THAT(result.triangles, ElementsAre(1, kNoTriangle, 0, kNoTriangle));
  EXPECT_THAT(result.truncated, IsEmpty());
}

TEST(RayQueryTest, AllKeepsTheNearestHitsAndListsTruncatedRays) {
  QueryWorld world;
  for (Id id = 1; id <= 6; ++id) world.objects.push_back(ball_object(id, {3.0 * double(id), 0, 0}));
  OwnedBlock block = rays_along_x(RayMode::kAll, {0, 0, 0, 14, 0, 0, 0, 50, 0});
  block.settings.max_results = 3;
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.counts, ElementsAre(3, 2, 0));
  EXPECT_THAT(result.ids, ElementsAre(1, 2, 3, 5, 6));
  EXPECT_THAT(result.truncated, ElementsAre(0));
}

TEST(RayQueryTest, AllWithExactlyMaxResultsHitsIsNotTruncated) {
  QueryWorld world;
  world.objects = {ball_object(1, {3, 0, 0}), ball_object(2, {6, 0, 0})};
  OwnedBlock block = rays_along_x(RayMode::kAll);
  block.settings.max_results = 2;
  EXPECT_THAT(run_block(*snapshot_of(world), block).truncated, IsEmpty());
}

TEST(RayQueryTest, AllReportsAnObjectOnce) {
  QueryWorld world;
  world.objects = {ball_object(1, {5, 0, 0})};
  for (const Inside inside : {Inside::kSolid, Inside::kHollow, Inside::kSkip}) {
    OwnedBlock block = rays_along_x(RayMode::kAll);
    rays_of(block).inside = inside;
    EXPECT_THAT(run_block(*snapshot_of(world), block).ids, ElementsAre(1));
  }
}

// A hit of an instance must not end the search for objects, and a hit of an object must not hide a nearer hit of an
// instance.
TEST(RayQueryTest, TheNearerOfAnInstanceAndAnObjectWins) {
  for (const double wall : {3.0, 7.0}) {
    QueryWorld world;
    world.objects = {ball_object(1, {6, 0, 0})};
    world.instances = {placed(2, wall_mesh(), {wall, 0, 0})};
    const BlockResult result = run_block(*snapshot_of(world), rays_along_x(RayMode::kFirst));
    EXPECT_THAT(result.t, ElementsAre(wall == 3 ? 3 : 5));
    EXPECT_THAT(result.ids, ElementsAre(wall == 3 ? 2 : 1));
  }
}

TEST(RayQueryTest, AtEqualDistanceTheLowerIdWinsAcrossInstancesAndObjects) {
  for (const Id instance : {Id{1}, Id{9}, kFirstChosenId | 1}) {
    QueryWorld world;
    world.objects = {box_object(5, {5, 0, 0})};
    world.instances = {placed(instance, wall_mesh(), {4, 0, 0})};
    const BlockResult first = run_block(*snapshot_of(world), rays_along_x(RayMode::kFirst));
    EXPECT_THAT(first.t, ElementsAre(4));
    EXPECT_THAT(first.ids, ElementsAre(std::min(instance, Id{5})));
    const BlockResult all = run_block(*snapshot_of(world), rays_along_x(RayMode::kAll));
    EXPECT_THAT(all.ids, ElementsAre(std::min(instance, Id{5}), std::max(instance, Id{5})));
  }
}

TEST(RayQueryTest, AtEqualDistanceTheLowerIdWinsAmongInstancesAndAmongObjects) {
  QueryWorld world;
  for (const Id id : {Id{8}, Id{3}, Id{6}}) world.instances.push_back(placed(id, wall_mesh(), {4, 0, 0}));
  EXPECT_THAT(run_block(*snapshot_of(world), rays_along_x(RayMode::kFirst)).ids, ElementsAre(3));
  EXPECT_THAT(run_block(*snapshot_of(world), rays_along_x(RayMode::kAll)).ids, ElementsAre(3, 6, 8));
  QueryWorld objects;
  for (const Id id : {Id{8}, Id{3}, Id{6}}) objects.objects.push_back(box_object(id, {5, 0, 0}));
  EXPECT_THAT(run_block(*snapshot_of(objects), rays_along_x(RayMode::kFirst)).ids, ElementsAre(3));
}

TEST(RayQueryTest, AtEqualDistanceAndIdTheLowerTriangleWins) {
  QueryWorld world;
  world.instances = {placed(1, mesh_of({wall_triangle(9), wall_triangle(4), wall_triangle(4), wall_triangle(4)}))};
  EXPECT_THAT(run_block(*snapshot_of(world), rays_along_x(RayMode::kFirst)).triangles, ElementsAre(1));
  EXPECT_THAT(run_block(*snapshot_of(world), rays_along_x(RayMode::kAll)).triangles, ElementsAre(1, 2, 3, 0));
}

// Which of several hits with equal t are returned must not depend on the order in which the objects are visited.
TEST(RayQueryTest, TruncationAmongEqualDistancesKeepsTheLowestIds) {
  QueryWorld world;
  for (Id id = 40; id > 0; --id) {
    if (id % 2 == 0) world.objects.push_back(box_object(id, {5, 0, 0}));
    if (id % 2 != 0) world.instances.push_back(placed(id, wall_mesh(), {4, 0, 0}));
  }
  OwnedBlock block = rays_along_x(RayMode::kAll);
  block.settings.max_results = 5;
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.ids, ElementsAre(1, 2, 3, 4, 5));
  EXPECT_THAT(result.truncated, ElementsAre(0));
}

TEST(RayQueryTest, AHitExactlyAtTMaxCounts) {
  QueryWorld world;
  world.objects = {box_object(1, {5, 0, 0})};
  world.instances = {placed(2, wall_mesh(), {4, 0, 0})};
  for (const Source source : {Source::kStatic, Source::kDynamic}) {
    for (const RayMode mode : {RayMode::kFirst, RayMode::kAny, RayMode::kAll}) {
      OwnedBlock block = rays_along_x(mode);
      block.settings.source = source;
      block.extras = {4};
      const BlockResult at = run_block(*snapshot_of(world), block);
      block.extras = {std::nextafter(4.0f, 0.0f)};
      const BlockResult before = run_block(*snapshot_of(world), block);
      if (mode == RayMode::kAny) {
        EXPECT_EQ(at.hits + before.hits, std::string("\1\0", 2));
      } else {
        EXPECT_EQ(at.t[0], 4);
        EXPECT_TRUE(before.t.empty() || before.t[0] == kInfinity);
      }
    }
  }
}

TEST(RayQueryTest, ARayOfLengthZeroHitsTheSurfaceAtItsOrigin) {
  QueryWorld world;
  world.objects = {box_object(1, {5, 0, 0})};
  world.instances = {placed(2, wall_mesh(), {4, 0, 0})};
  OwnedBlock block = rays_along_x(RayMode::kAll, {4, 0, 0});
  block.extras = {0};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.t, ElementsAre(0, 0));
  EXPECT_THAT(result.ids, ElementsAre(1, 2));
  EXPECT_FALSE(std::signbit(result.t[0]) || std::signbit(result.t[1]));
}

TEST(RayQueryTest, DistancesAreMultiplesOfTheGivenDirection) {
  QueryWorld world;
  world.objects = {box_object(1, {5, 0, 0})};
  world.instances = {placed(2, wall_mesh(), {-8, 0, 0})};
  world.instances[0].scale = 4;
  for (const float length : {0.125f, 1.0f, 4.0f, 1e-30f, 1e30f}) {
    EXPECT_THAT(run_block(*snapshot_of(world), one_ray(RayMode::kFirst, {}, {length, 0, 0})).t,
                ElementsAre(4 / length));
    EXPECT_THAT(run_block(*snapshot_of(world), one_ray(RayMode::kFirst, {}, {-length, 0, 0})).t,
                ElementsAre(8 / length));
  }
}

TEST(RayQueryTest, TrianglesAreTwoSidedUnlessOneSideIsCulled) {
  const Triangle to_ray = turned_over(wall_triangle(3)), from_ray = wall_triangle(5);
  for (const Winding winding : {Winding::kCounterClockwise, Winding::kClockwise}) {
    QueryWorld world;
    world.winding = winding;
    world.instances = {placed(1, mesh_of({to_ray, from_ray}))};
    const bool flipped = winding == Winding::kClockwise;
    OwnedBlock block = rays_along_x(RayMode::kAll);
    block.settings.columns = {Column::kTriangle, Column::kNormal};
    EXPECT_THAT(run_block(*snapshot_of(world), block).triangles, ElementsAre(0, 1));
    rays_of(block).cull = Cull::kBack;
    const BlockResult fronts = run_block(*snapshot_of(world), block);
    EXPECT_THAT(fronts.triangles, ElementsAre(flipped ? 1 : 0));
    EXPECT_THAT(fronts.normals, ElementsAre(-1, 0, 0)) << "hits with culled backs have normals against the ray";
    rays_of(block).cull = Cull::kFront;
    const BlockResult backs = run_block(*snapshot_of(world), block);
    EXPECT_THAT(backs.triangles, ElementsAre(flipped ? 0 : 1));
    EXPECT_THAT(backs.normals, ElementsAre(1, 0, 0));
  }
}

TEST(RayQueryTest, CullDoesNotApplyToObjects) {
  QueryWorld world;
  world.objects = {ball_object(1, {5, 0, 0})};
  for (const Cull cull : {Cull::kNone, Cull::kBack, Cull::kFront}) {
    OwnedBlock block = rays_along_x(RayMode::kFirst);
    rays_of(block).cull = cull;
    EXPECT_THAT(run_block(*snapshot_of(world), block).t, ElementsAre(4));
  }
}

TEST(RayQueryTest, NormalsFollowTheUploadedWindingForBothSides) {
  QueryWorld world;
  world.instances = {placed(1, wall_mesh(), {4, 0, 0})};
  for (const float from : {0.0f, 8.0f}) {
    OwnedBlock block = one_ray(RayMode::kFirst, {from, 0, 0}, {4 - from, 0, 0});
    block.settings.columns = {Column::kNormal};
    world.winding = Winding::kCounterClockwise;
    EXPECT_THAT(run_block(*snapshot_of(world), block).normals, ElementsAre(1, 0, 0));
    world.winding = Winding::kClockwise;
    EXPECT_EQ(run_block(*snapshot_of(world), block).normals[0], -1);
  }
}

TEST(RayQueryTest, NormalsRotateWithTheInstance) {
  QueryWorld world;
  world.instances = {placed(1, wall_mesh(), {0, 5, 0})};
  world.instances[0].rotation = {0, 0, std::sqrt(0.5f), std::sqrt(0.5f)};  // turns x to y
  world.instances[0].scale = 3;
  OwnedBlock block = one_ray(RayMode::kFirst, {}, {0, 2, 0});
  block.settings.columns = {Column::kT, Column::kNormal};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_NEAR(result.t[0], 2.5, 1e-6);
  EXPECT_NEAR(result.normals[0], 0, 1e-6);
  EXPECT_NEAR(result.normals[1], 1, 1e-6);
}

TEST(RayQueryTest, AnOriginInsideASolidHitsAtZeroWithANormalAgainstTheRay) {
  QueryWorld world;
  world.objects = {ball_object(1, {0, 0, 0}, 2)};
  OwnedBlock block = one_ray(RayMode::kFirst, {0.5f, 0, 0}, {4, 0, 3});
  block.settings.columns = {Column::kT, Column::kNormal, Column::kPoint};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.t, ElementsAre(0));
  EXPECT_THAT(result.normals, ElementsAre(-0.8f, 0, -0.6f));
  EXPECT_THAT(result.points, ElementsAre(0.5f, 0, 0));
}

TEST(RayQueryTest, AHollowSolidIsHitWhereTheRayLeavesIt) {
  QueryWorld world;
  world.objects = {ball_object(1, {0, 0, 0}, 2), box_object(2, {10, 0, 0})};
  OwnedBlock block = rays_along_x(RayMode::kAll);
  rays_of(block).inside = Inside::kHollow;
  block.settings.columns = {Column::kT, Column::kId, Column::kNormal};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.t, ElementsAre(2, 9));
  EXPECT_THAT(result.normals, ElementsAre(1, 0, 0, -1, 0, 0));
}

TEST(RayQueryTest, ASkippedSolidIsPassedByRaysFromInsideOnly) {
  QueryWorld world;
  world.objects = {ball_object(1, {0, 0, 0}, 2), box_object(2, {10, 0, 0})};
  OwnedBlock block = rays_along_x(RayMode::kFirst, {0, 0, 0, -5, 0, 0});
  rays_of(block).inside = Inside::kSkip;
  EXPECT_THAT(run_block(*snapshot_of(world), block).ids, ElementsAre(2, 1));
}

TEST(RayQueryTest, InsideDoesNotApplyToTriangles) {
  QueryWorld world;
  world.instances = {placed(1, wall_mesh())};
  for (const Inside inside : {Inside::kSolid, Inside::kHollow, Inside::kSkip}) {
    OwnedBlock block = rays_along_x(RayMode::kFirst);
    rays_of(block).inside = inside;
    EXPECT_THAT(run_block(*snapshot_of(world), block).t, ElementsAre(0));
  }
}

TEST(RayQueryTest, PointsAreNeverHit) {
  QueryWorld world;
  Object point;
  point.id = 1;
  point.shape.position = {4, 0, 0};
  world.objects = {point};
  EXPECT_THAT(run_block(*snapshot_of(world), rays_along_x(RayMode::kFirst)).ids, ElementsAre(0));
}

TEST(RayQueryTest, EdgeOnTrianglesAndTrianglesWithoutAreaAreNeverHit) {
  QueryWorld world;
  const Triangle edge_on = {{1, -1, 0}, {3, -1, 0}, {2, 2, 0}};
  const Triangle line = {{4, -1, 0}, {4, 0, 0}, {4, 1, 0}};
  world.instances = {placed(1, mesh_of({edge_on, line, wall_triangle(9)}))};
  const BlockResult result = run_block(*snapshot_of(world), rays_along_x(RayMode::kAll));
  EXPECT_THAT(result.triangles, ElementsAre(2)) << "numbering is kept";
}

TEST(RayQueryTest, UvAndPointDescribeTheSamePosition) {
  Random random(31);
  QueryWorld world;
  const Triangle triangle = {{1, 2, 3}, {-2, 5, 1}, {0, -3, -4}};
  PlacedMesh instance = placed(1, mesh_of({triangle}), {100, -50, 20});
  instance.rotation = random.rotation();
  instance.scale = 2.5f;
  world.instances = {instance};
  const SnapshotPtr snapshot = snapshot_of(world);
  const Transform& transform = snapshot->statics->find(1)->transform;
  const auto weighted = [&](double u, double v) {  // point of the placed triangle, relative to the frame
    const Vec3d in_mesh = to_double(triangle.a) * (1 - u - v) + to_double(triangle.b) * u + to_double(triangle.c) * v;
    return transform.point_to_world(in_mesh) - instance.translation;
  };
  for (int i = 0; i < 200; ++i) {
    const double u = 0.01 + random.unit() * 0.9, v = random.unit() * (0.95 - u);
    const Vec3f origin = random.float_vector(30);
    OwnedBlock block = one_ray(RayMode::kFirst, origin, to_float(weighted(u, v) - to_double(origin)));
    block.settings.frame = instance.translation;
    block.settings.columns = {Column::kUv, Column::kPoint, Column::kNormal};
    const BlockResult result = run_block(*snapshot, block);
    EXPECT_NEAR(result.uvs[0], u, 1e-3) << "seed 31";
    EXPECT_NEAR(result.uvs[1], v, 1e-3);
    const Vec3d place = weighted(result.uvs[0], result.uvs[1]);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(result.points[static_cast<size_t>(axis)], place[axis], 2e-5);
    EXPECT_NEAR(std::hypot(result.normals[0], result.normals[1], result.normals[2]), 1, 1e-6);
  }
}

TEST(RayQueryTest, ConservativeRaysEnterBoundsAndHaveNoSurface) {
  QueryWorld world;
  world.objects = {ball_object(1, {5, 0, 0})};
  OwnedBlock block = one_ray(RayMode::kFirst, {0, 0.9f, 0.9f}, {1, 0, 0});  // enters the bounds, misses the ball
  EXPECT_THAT(run_block(*snapshot_of(world), block).ids, ElementsAre(0));
  block.settings.precision = Precision::kConservative;
  block.settings.columns = {Column::kT, Column::kId, Column::kNormal, Column::kUv};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.ids, ElementsAre(1));
  EXPECT_NEAR(result.t[0], 4, 1e-6);
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 0));
  EXPECT_THAT(result.uvs, ElementsAre(0, 0));
}

// The hit may be early because of two paddings. The bounds of a placed triangle are grown by 2^-41 times the sum of the
// magnitude of the translation and four times the magnitude of the mesh. The slab test is padded by 2^-40 times the sum
// of the magnitudes of the ray's origin and of the bounds.
TEST(RayQueryTest, ConservativeRaysEnterBoundsOfPlacedTrianglesWhereTheyAreFarFromTheOrigin) {
  for (const double away : {0.0, 1e3, 1e6, 1e9 - 100}) {
    QueryWorld world;
    world.instances = {placed(4, cube_mesh(), {away, -away, 0})};
    OwnedBlock block = one_ray(RayMode::kFirst, {-11, 0.25f, 0.5f}, {1, 0, 0});
    block.settings.frame = {away, -away, 0};
    EXPECT_THAT(run_block(*snapshot_of(world), block).t, ElementsAre(10));
    block.settings.precision = Precision::kConservative;
    const BlockResult result = run_block(*snapshot_of(world), block);
    EXPECT_THAT(result.ids, ElementsAre(4));
    EXPECT_LE(result.t[0], 10);
    EXPECT_GE(result.t[0], 10 - std::max(1e-6, away * 0x1p-38)) << away;
  }
}

TEST(RayQueryTest, ConservativeRaysMissPlacedTrianglesThatTheyMissFarFromTheOrigin) {
  QueryWorld world;
  world.instances = {placed(4, cube_mesh(), {1e6, 0, 0})};
  OwnedBlock block = one_ray(RayMode::kAny, {-11, 1.0001f, 0}, {1, 0, 0});
  block.settings.frame = {1e6, 0, 0};
  block.settings.precision = Precision::kConservative;
  EXPECT_EQ(run_block(*snapshot_of(world), block).hits, std::string("\0", 1));
}

class FarHitTest : public ::testing::TestWithParam<Precision> {
 protected:
  // Places walls at t = 5e44 and t = 9e44, which are too large for a float, and a ball between the walls.
  FarHitTest() {
    world_.objects = {ball_object(3, {7, 0, 0})};
    world_.instances = {placed(9, wall_mesh(), {5, 0, 0}), placed(2, wall_mesh(), {9, 0, 0})};
  }
  BlockResult answer(RayMode mode, float t_max) const {
    OwnedBlock block = one_ray(mode, {0, 0, 0}, {1e-44f, 0, 0});
    block.extras = {t_max};
    block.settings.precision = GetParam();
    return run_block(*snapshot_of(world_), block);
  }

  QueryWorld world_;
};

constexpr float kLargest = std::numeric_limits<float>::max();

TEST_P(FarHitTest, AHitBeyondTheLargestFloatIsReportedAtTheLargestFloat) {
  const BlockResult first = answer(RayMode::kFirst, kInfinity);
  EXPECT_THAT(first.t, ElementsAre(kLargest));
  EXPECT_THAT(first.ids, ElementsAre(2));
  const BlockResult all = answer(RayMode::kAll, kInfinity);
  EXPECT_THAT(all.t, ElementsAre(kLargest, kLargest, kLargest));
  EXPECT_THAT(all.ids, ElementsAre(2, 3, 9));
}

TEST_P(FarHitTest, AHitBeyondTheLargestFloatIsWithinATMaxOfThatValueAndBeyondAnySmallerOne) {
  EXPECT_EQ(answer(RayMode::kAny, kLargest).hits, "\1");
  EXPECT_THAT(answer(RayMode::kFirst, kLargest).ids, ElementsAre(2));
  EXPECT_EQ(answer(RayMode::kAny, std::nextafter(kLargest, 0.0f)).hits, std::string("\0", 1));
  EXPECT_THAT(answer(RayMode::kFirst, std::nextafter(kLargest, 0.0f)).t, ElementsAre(kInfinity));
}

TEST_P(FarHitTest, AHitBeyondTheLargestFloatHasItsPointAtTheLargestFloat) {
  OwnedBlock block = one_ray(RayMode::kFirst, {1, 0, 0}, {1e-44f, 0, 0});
  block.settings.columns = {Column::kPoint};
  block.settings.precision = GetParam();
  const BlockResult result = run_block(*snapshot_of(world_), block);
  EXPECT_THAT(result.points, ElementsAre(static_cast<float>(1 + double{1e-44f} * double{kLargest}), 0, 0));
}

INSTANTIATE_TEST_SUITE_P(Precisions, FarHitTest, ::testing::Values(Precision::kExact, Precision::kConservative));

}  // namespace
}  // namespace locus::test
