// Contacts of balls, capsules and boxes: distance, nearest point and normal of each object or triangle that they
// overlap.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/query/kinds/overlap_query.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/random_query.h"
#include "tests/support/random_shape.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatNear;

BlockResult ball_contacts(const QueryWorld& world, Vec3f center, float radius, StaticDetail detail = {}) {
  OwnedBlock block;
  block.settings.kind = BallColumns{{}, {}, detail};
  block.settings.columns = {Column::kT, Column::kId, Column::kTriangle, Column::kNormal, Column::kPoint};
  block.points = {center.x, center.y, center.z};
  block.sizes = {radius};
  return run_block(*snapshot_of(world), block);
}

TEST(OverlapContactTest, TheDistanceToAWallIsThatOfItsNearestTriangle) {
  QueryWorld world;
  world.instances = {placed(7, mesh_of({wall_triangle(3), wall_triangle(1), wall_triangle(-2)}))};
  const BlockResult result = ball_contacts(world, {0, 0, 0}, 4);
  EXPECT_THAT(result.ids, ElementsAre(7u));
  EXPECT_THAT(result.triangles, ElementsAre(kNoTriangle));
  EXPECT_THAT(result.t, ElementsAre(1));
  EXPECT_THAT(result.points, ElementsAre(1, 0, 0));
  EXPECT_THAT(result.normals, ElementsAre(-1, 0, 0));
  const BlockResult rows = ball_contacts(world, {0, 0, 0}, 4, StaticDetail::kTrianglesSorted);
  EXPECT_THAT(rows.triangles, ElementsAre(0u, 1u, 2u));
  EXPECT_THAT(rows.t, ElementsAre(3, 1, 2));
}

TEST(OverlapContactTest, InsideAnObjectTheDistanceIsMinusTheShortestWayOut) {
  QueryWorld world;
  world.objects = {ball_object(1, {0, 0, 0}, 5), box_object(2, {0, 0, 0}, {4, 6, 6})};
  const BlockResult result = ball_contacts(world, {3, 0, 0}, 0.5f);
  EXPECT_THAT(result.ids, ElementsAre(1u, 2u));
  EXPECT_THAT(result.t, ElementsAre(-2, -1));
  EXPECT_THAT(result.normals, ElementsAre(1, 0, 0, 1, 0, 0));
}

TEST(OverlapContactTest, ACapsuleMeasuresFromItsInnerSegment) {
  QueryWorld world;
  world.objects = {ball_object(1, {0, 3, 0}, 1)};
  OwnedBlock block;
  block.settings.kind = CapsuleColumns{};
  block.settings.columns = {Column::kT, Column::kNormal, Column::kPoint};
  block.points = {-5, 0, 0};
  block.sizes = {5, 0, 0};
  block.extras = {2.5f};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.t, ElementsAre(2));
  EXPECT_THAT(result.points, ElementsAre(0, 2, 0));
  EXPECT_THAT(result.normals, ElementsAre(0, -1, 0));
}

BlockResult box_contacts(const QueryWorld& world, Vec3f center, Vec3f half, const Quaternion& q = {},
                         StaticDetail detail = {}) {
  OwnedBlock block;
  block.settings.kind = BoxColumns{{}, {}, {}, detail};
  block.settings.columns = {Column::kT, Column::kId, Column::kTriangle, Column::kNormal, Column::kPoint};
  block.points = {center.x, center.y, center.z};
  block.sizes = {half.x, half.y, half.z};
  block.extras = {q.x, q.y, q.z, q.w};
  return run_block(*snapshot_of(world), block);
}

TEST(OverlapContactTest, ABoxReportsMinusItsDepthAndTheShortestWayOut) {
  QueryWorld world;
  world.objects = {ball_object(1, {3, 0, 0}, 2), box_object(2, {0, 0, 4}, {9, 9, 3.5f})};
  const BlockResult result = box_contacts(world, {0, 0, 0}, {2, 1, 1});
  EXPECT_THAT(result.ids, ElementsAre(1u, 2u));
  EXPECT_THAT(result.t, ElementsAre(FloatNear(-1, 1e-6f), FloatNear(-0.5f, 1e-6f)));
  EXPECT_THAT(result.normals, ElementsAre(-1, 0, 0, 0, 0, -1));
  EXPECT_THAT(std::vector<float>(result.points.begin(), result.points.begin() + 3), ElementsAre(2, 0, 0))
      << "a point of both";
  const BlockResult touching = box_contacts(world, {-1, 0, 0}, {2, 1, 0.5f});
  EXPECT_THAT(touching.ids, ElementsAre(1u, 2u));
  EXPECT_THAT(touching.t, ElementsAre(FloatNear(0, 1e-6f), FloatNear(0, 1e-6f)));
}

TEST(OverlapContactTest, ABoxReportsTheTriangleIntoWhichItReachesMostDeeply) {
  QueryWorld world;
  world.instances = {placed(7, mesh_of({wall_triangle(0.75f), wall_triangle(0.25f), wall_triangle(-0.5f)}))};
  const BlockResult result = box_contacts(world, {0, 0, 0}, {1, 1, 1});
  EXPECT_THAT(result.ids, ElementsAre(7u));
  EXPECT_THAT(result.t, ElementsAre(FloatNear(-0.75f, 1e-6f)));
  EXPECT_THAT(result.normals, ElementsAre(-1, 0, 0));
  const BlockResult rows = box_contacts(world, {0, 0, 0}, {1, 1, 1}, {}, StaticDetail::kTrianglesSorted);
  EXPECT_THAT(rows.triangles, ElementsAre(0u, 1u, 2u));
  EXPECT_THAT(rows.t, ElementsAre(FloatNear(-0.25f, 1e-6f), FloatNear(-0.75f, 1e-6f), FloatNear(-0.5f, 1e-6f)));
}

TEST(OverlapContactTest, AConservativeBoxReportsAPointOfTheBounds) {
  QueryWorld world;
  world.objects = {ball_object(1, {3, 0, 0}, 2)};
  OwnedBlock block;
  block.settings.kind = BoxColumns{};
  block.settings.precision = Precision::kConservative;
  block.settings.columns = {Column::kT, Column::kNormal, Column::kPoint};
  block.points = {0, 0, 0};
  block.sizes = {2, 1, 1};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.t, ElementsAre(0));
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 0));
  EXPECT_THAT(result.points, ElementsAre(FloatNear(1, 1e-6f), 0, 0));
}

// Returns an object of a random shape near the origin.
Object object_of_random_shape(Random& random) {
  Object object;
  object.id = 1;
  object.shape = random_shape(random, random.pick(kShapeKinds), 1);
  for (int axis = 0; axis < 3; ++axis) object.shape.size[axis] = random.float_between(0.1, 2);
  object.shape.radius = random.float_between(0.1, 2);
  return object;
}

// A box that is moved out along the normal by its depth just touches the object or triangle, and a box that is moved
// out a little less still overlaps it. The point belongs to both.
TEST(OverlapContactTest, TheBoxMovedOutByItsDepthTouches) {
  size_t checked = 0;
  for (uint64_t seed = 0; seed < scaled_count(3'000); ++seed) {
    Random random(seed);
    const Object object = object_of_random_shape(random);
    QueryWorld world;
    world.objects = {object};
    const Vec3f center = to_float(random.vector(2)), half = to_float(random.positive_vector(2));
    const Quaternion q = random.rotation();
    const BlockResult result = box_contacts(world, center, half, q);
    if (result.t.empty()) continue;
    const Vec3d normal = read_vec3d(result.normals.data()), point = read_vec3d(result.points.data());
    ASSERT_NEAR(std::sqrt(squared_length(normal)), 1, 1e-6) << "seed " << seed;
    ASSERT_LE(result.t[0], 1e-6) << "seed " << seed;
    const auto moved = [&](double way) {
      return Obbd{to_double(center) + normal * way, to_double(half), rotation_of(q)};
    };
    ASSERT_FALSE(box_overlaps(moved(1e-4 - result.t[0]), object.shape)) << "seed " << seed;
    ASSERT_TRUE(box_overlaps(moved(-1e-4 - result.t[0]), object.shape)) << "seed " << seed;
    ASSERT_TRUE(ball_overlaps(Balld{point, 1e-5}, object.shape)) << "seed " << seed;
    const Vec3d in_box = abs(rotation_of(q).to_local(point - to_double(center))) - to_double(half);
    ASSERT_LE(max_component(in_box), 1e-5) << "seed " << seed;
    ++checked;
  }
  EXPECT_GT(checked, scaled_count(500));
}

TEST(OverlapContactTest, ConservativeMeasuresToTheBounds) {
  QueryWorld world;
  world.objects = {ball_object(1, {0, 0, 0}, 1)};
  OwnedBlock block;
  block.settings.kind = BallColumns{};
  block.settings.precision = Precision::kConservative;
  block.settings.columns = {Column::kT, Column::kNormal, Column::kPoint};
  block.points = {2, 2, 0};
  block.sizes = {3};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.t, ElementsAre(FloatNear(std::sqrt(2.0f), 1e-6f)));
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 0));
}

// The depth of an overlap is the ball's radius minus the reported distance t: a ball that is moved out along the normal
// by this depth just touches the object, and a ball that is moved out a little less still overlaps the object.
TEST(OverlapContactTest, TheBallMovedOutByItsDepthTouches) {
  size_t checked = 0;
  for (uint64_t seed = 0; seed < scaled_count(3'000); ++seed) {
    Random random(seed);
    const Object object = object_of_random_shape(random);
    QueryWorld world;
    world.objects = {object};
    const Vec3f center = to_float(random.vector(3));
    const float radius = random.float_between(0.1, 2);
    const BlockResult result = ball_contacts(world, center, radius);
    if (result.t.empty()) continue;
    const Vec3d normal = read_vec3d(result.normals.data());
    const double t = result.t[0];
    ASSERT_LE(t, radius * (1 + 1e-6)) << "seed " << seed;
    ASSERT_NEAR(std::sqrt(squared_length(normal)), 1, 1e-6) << "seed " << seed;
    const double depth = radius - t;
    const Shape shape = object.shape;
    const Vec3d out = to_double(center) + normal * depth;
    ASSERT_FALSE(ball_overlaps(Balld{out + normal * 1e-4, double{radius}}, shape)) << "seed " << seed;
    ASSERT_TRUE(ball_overlaps(Balld{out - normal * 1e-4, double{radius}}, shape)) << "seed " << seed;
    const Vec3d point = read_vec3d(result.points.data());
    // The contact point belongs to the object, also if the ball's centre is inside the object.
    ASSERT_TRUE(ball_overlaps(Balld{point, 1e-5}, shape)) << "seed " << seed;
    if (t > 0) {
      ASSERT_NEAR(std::sqrt(squared_length(point - to_double(center))), t, 1e-4) << "seed " << seed;
    }
    ++checked;
  }
  EXPECT_GT(checked, scaled_count(500));
}

TEST(OverlapContactTest, ContactsAreFiniteAndNormalsUnitOrZero) {
  for (uint64_t seed = 0; seed < scaled_count(400); ++seed) {
    Random random(seed);
    const QueryScene scene = query_scene(troublesome_sketch(seed, random), random);
    const SnapshotPtr snapshot = snapshot_of(scene.world);
    for (OwnedBlock block : scene.blocks) {
      const BlockKind kind = block_kind(block.settings);
      if (kind != BlockKind::kBall && kind != BlockKind::kCapsule && kind != BlockKind::kBox &&
          kind != BlockKind::kNearest)
        continue;
      block.settings.columns = {Column::kT, Column::kNormal, Column::kPoint};
      if (kind == BlockKind::kNearest) block.settings.columns.add(Column::kUv);
      const BlockResult result = run_block(*snapshot, block);
      for (const float t : result.t) ASSERT_TRUE(std::isfinite(t)) << "seed " << seed;
      for (size_t i = 0; i < result.normals.size(); i += 3) {
        const double length = std::sqrt(squared_length(read_vec3d(&result.normals[i])));
        ASSERT_TRUE(length == 0 || std::abs(length - 1) < 1e-6) << "seed " << seed << ", length " << length;
      }
      for (const float weight : result.uvs) ASSERT_TRUE(weight >= 0 && weight <= 1) << "seed " << seed;
    }
  }
}

TEST(NearestSurfaceTest, WeightsAndNormalBelongToTheNearestPoint) {
  QueryWorld world;
  world.instances = {placed(1, mesh_of({{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, 0}}))};
  OwnedBlock block;
  block.settings.kind = NearestColumns{};
  block.settings.columns = {Column::kUv, Column::kNormal, Column::kPoint};
  block.points = {1, 2, 5, 6, 0, 0, 1, 1, 0};
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.uvs, ElementsAre(0.25f, 0.5f, 1, 0, 0.25f, 0.25f));
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 1, 1, 0, 0, 0, 0, 1));
  EXPECT_THAT(result.points, ElementsAre(1, 2, 0, 4, 0, 0, 1, 1, 0));
}

}  // namespace
}  // namespace locus::test
