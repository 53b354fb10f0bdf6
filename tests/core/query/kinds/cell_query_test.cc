// Cells of free space in small and random worlds. In random worlds, these properties are checked in long double: the
// cell contains the query's point; no sampled point of an object or triangle is in the cell; and the reported distance
// of each plane is the distance between the query's point and the plane's reported point.
#include "core/query/kinds/cell_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/shape_distance.h"
#include "tests/support/random_query.h"
#include "tests/support/real.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

OwnedBlock cell_at(Vec3f point, float max_distance, uint32_t planes = 0) {
  OwnedBlock block;
  block.settings.kind = CellColumns{{}, {}, planes};
  block.settings.columns = {Column::kT, Column::kId, Column::kTriangle, Column::kNormal, Column::kPoint};
  block.points = {point.x, point.y, point.z};
  block.extras = {max_distance};
  return block;
}

TEST(CellQueryTest, TheFirstRowIsTheBallAndEachFurtherRowAPlane) {
  QueryWorld world;
  world.instances = {placed(7, wall_mesh(), {4, 0, 0})};
  world.objects = {ball_object(1, {-6, 0, 0})};
  const BlockResult result = run_block(*snapshot_of(world), cell_at({0, 0, 0}, 50));
  EXPECT_THAT(result.ids, ElementsAre(0u, 7u, 1u));
  EXPECT_THAT(result.t, ElementsAre(50, 4, 5));
  EXPECT_THAT(result.triangles, ElementsAre(kNoTriangle, 0u, kNoTriangle));
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 0, 1, 0, 0, -1, 0, 0));
  EXPECT_THAT(result.points, ElementsAre(0, 0, 0, 4, 0, 0, -5, 0, 0));
}

TEST(CellQueryTest, WhatLiesBeyondAPlaneAddsNone) {
  QueryWorld world;
  world.instances = {placed(7, wall_mesh(), {4, 0, 0}), placed(8, wall_mesh(), {6, 0, 0})};
  world.objects = {ball_object(1, {5, 0, 0}), ball_object(2, {9, 1, 1})};
  EXPECT_THAT(run_block(*snapshot_of(world), cell_at({0, 0, 0}, 50)).ids, ElementsAre(0u, 1u));
}

TEST(CellQueryTest, WhenPlanesRunOutTheBallShrinks) {
  QueryWorld world;
  world.objects = {ball_object(1, {3, 0, 0}), ball_object(2, {0, 4, 0}), ball_object(3, {0, 0, 5})};
  const BlockResult result = run_block(*snapshot_of(world), cell_at({0, 0, 0}, 50, 2));
  EXPECT_THAT(result.ids, ElementsAre(0u, 1u, 2u));
  EXPECT_THAT(result.t, ElementsAre(4, 2, 3));
  EXPECT_THAT(result.truncated, ElementsAre(0u));
}

TEST(CellQueryTest, APointInOrOnSomethingHasNoSpace) {
  QueryWorld world;
  world.instances = {placed(7, wall_mesh(), {4, 0, 0})};
  world.objects = {ball_object(1, {-6, 0, 0})};
  EXPECT_THAT(run_block(*snapshot_of(world), cell_at({-6.5f, 0, 0}, 50)).ids, IsEmpty());
  EXPECT_THAT(run_block(*snapshot_of(world), cell_at({4, 0, 0}, 50)).counts, ElementsAre(0u));
}

TEST(CellQueryTest, AnEmptyWorldLeavesTheWholeBall) {
  EXPECT_THAT(run_block(*snapshot_of({}), cell_at({1, 2, 3}, 5)).t, ElementsAre(5));
}

// Returns how far `samples`, points of an object or triangle, reach into the cell: the depth of the deepest sample
// within the cell's ball. The depth of a sample is its least distance from a plane or from the ball's surface, measured
// inward; the depth is negative if the sample is outside a plane.
Real reach_into(const BlockResult& cell, Vec3r center, const std::vector<Vec3r>& samples) {
  Real most = -1e30L;
  for (const Vec3r sample : samples) {
    if (length(sample - center) > Real{cell.t[0]}) continue;
    Real least = Real{cell.t[0]} - length(sample - center);
    for (size_t plane = 1; plane < cell.ids.size(); ++plane) {
      const Vec3r normal = to_real(read_vec3d(&cell.normals[3 * plane]));
      const Vec3r at = to_real(read_vec3d(&cell.points[3 * plane]));
      least = std::min(least, dot(normal, at - sample));
    }
    most = std::max(most, least);
  }
  return most;
}

TEST(CellQueryTest, NothingReachesIntoRandomCells) {
  size_t planes = 0;
  for (uint64_t seed = 0; seed < scaled_count(300); ++seed) {
    Random random(seed);
    QueryWorld world;
    std::vector<Triangle> triangles;
    for (uint32_t i = 0; i < 40; ++i) {
      const Vec3d at = random.vector(10);
      triangles.push_back(
          {to_float(at + random.vector(2)), to_float(at + random.vector(2)), to_float(at + random.vector(2)), i});
    }
    world.instances = {placed(100, mesh_of(triangles))};
    for (Id id = 1; id <= 20; ++id)
      world.objects.push_back(ball_object(id, random.vector(10), random.float_between(0.1f, 2)));
    const Vec3f point = to_float(random.vector(4));
    const BlockResult cell = run_block(*snapshot_of(world), cell_at(point, 12, 64));
    if (cell.ids.empty()) continue;
    const Vec3r center = to_real(point);
    for (size_t plane = 1; plane < cell.ids.size(); ++plane) {
      const Vec3r normal = to_real(read_vec3d(&cell.normals[3 * plane]));
      const Vec3r at = to_real(read_vec3d(&cell.points[3 * plane]));
      ASSERT_GT(dot(normal, at - center), 0) << "seed " << seed;  // the cell contains the point
      ASSERT_NEAR(double(length(at - center)), cell.t[plane], 1e-5) << "seed " << seed;
    }
    for (const Triangle& triangle : triangles) {
      std::vector<Vec3r> samples;
      for (int u = 0; u <= 10; ++u)
        for (int v = 0; u + v <= 10; ++v)
          samples.push_back(to_real(triangle.a) * (1 - (u + v) / 10.0L) + to_real(triangle.b) * (u / 10.0L) +
                            to_real(triangle.c) * (v / 10.0L));
      ASSERT_LT(reach_into(cell, center, samples), 1e-5L) << "seed " << seed << ", triangle " << triangle.number;
    }
    for (const Object& object : world.objects) {
      std::vector<Vec3r> samples;
      for (int i = 0; i < 60; ++i) {
        const Vec3d way = random.vector(1);
        if (way == Vec3d{}) continue;
        samples.push_back(to_real(object.shape.position + normalized(way) * double{object.shape.radius}));
      }
      ASSERT_LT(reach_into(cell, center, samples), 1e-5L) << "seed " << seed << ", object " << object.id;
    }
    planes += cell.ids.size() - 1;
  }
  EXPECT_GT(planes, scaled_count(1'000));
}

}  // namespace
}  // namespace locus::test
