// Every ray from inside a closed mesh hits the mesh, also when the ray is a query of a batch. This holds for placed,
// rotated, scaled and distant instances, for meshes in two halves, and for the modes FIRST and ANY.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/generated_meshes.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

// Returns rays from points near the centre to every vertex, and to the middle and a random point of every edge.
OwnedBlock rays_at_edges(const std::vector<Triangle>& triangles, const Transform& transform, Random& random) {
  OwnedBlock block = rays_along_x(RayMode::kFirst, {});
  block.sizes.clear();
  block.settings.frame = transform.translation;
  for (const Triangle& triangle : triangles) {
    const Vec3d corners[] = {to_double(triangle.a), to_double(triangle.b), to_double(triangle.c)};
    for (int edge = 0; edge < 3; ++edge) {
      const Vec3d from = corners[edge], along = corners[(edge + 1) % 3] - from;
      for (const double weight : {0.0, 0.5, random.unit()}) {
        const auto relative = [&](Vec3d mesh) { return transform.point_to_world(mesh) - transform.translation; };
        const Vec3f origin = to_float(relative(random.vector(0.3)));
        const Vec3f direction = to_float(relative(from + along * weight) - to_double(origin));
        block.points.insert(block.points.end(), {origin.x, origin.y, origin.z});
        block.sizes.insert(block.sizes.end(), {direction.x, direction.y, direction.z});
      }
    }
  }
  return block;
}

size_t leaks(const SceneSnapshot& snapshot, OwnedBlock block) {
  const BlockResult first = run_block(snapshot, block);
  rays_of(block).mode = RayMode::kAny;
  const BlockResult any = run_block(snapshot, block);
  EXPECT_GT(first.ids.size(), 0u);
  return static_cast<size_t>(std::count(first.ids.begin(), first.ids.end(), kNoId) +
                             std::count(any.hits.begin(), any.hits.end(), '\0'));
}

std::vector<PlacedMesh> placements(uint64_t seed) {
  Random random(seed);
  std::vector<PlacedMesh> result;
  for (const double distance : {0.0, 1e3, 1e6}) {
    for (const float scale : {1e-3f, 1.0f, 1e3f}) {
      PlacedMesh placed;
      placed.id = 1;
      placed.translation = random.vector(distance);
      placed.rotation = random.rotation();
      placed.scale = scale;
      result.push_back(placed);
    }
  }
  return result;
}

TEST(QueryWatertightTest, NoRayLeaksFromAPlacedMesh) {
  for (uint64_t seed = 0; seed < scaled_count(6); ++seed) {
    const std::vector<Triangle> sphere = bumpy_sphere(16, 0.1, seed);
    const StaticMeshPtr mesh = mesh_of(sphere);
    for (PlacedMesh placed : placements(seed)) {
      placed.mesh = mesh;
      QueryWorld world;
      world.instances = {placed};
      const SnapshotPtr snapshot = snapshot_of(world);
      Random random(seed);
      EXPECT_EQ(leaks(*snapshot, rays_at_edges(sphere, snapshot->statics->find(1)->transform, random)), 0u)
          << "seed " << seed << ", scale " << placed.scale;
    }
  }
}

// The odd triangles belong to one instance and the even triangles to another, so edges of the mesh are edges between
// instances.
TEST(QueryWatertightTest, NoRayLeaksBetweenInstancesOfEqualTransform) {
  for (uint64_t seed = 0; seed < scaled_count(6); ++seed) {
    const std::vector<Triangle> sphere = bumpy_sphere(16, 0.1, seed);
    std::vector<Triangle> halves[2];
    for (const Triangle& triangle : sphere) halves[triangle.number % 2].push_back(triangle);
    const StaticMeshPtr meshes[] = {mesh_of(halves[0]), mesh_of(halves[1])};
    for (PlacedMesh placed : placements(seed)) {
      QueryWorld world;
      for (Id id = 1; id <= 2; ++id) {
        placed.id = id;
        placed.mesh = meshes[id - 1];
        world.instances.push_back(placed);
      }
      const SnapshotPtr snapshot = snapshot_of(world);
      Random random(seed);
      EXPECT_EQ(leaks(*snapshot, rays_at_edges(sphere, snapshot->statics->find(1)->transform, random)), 0u)
          << "seed " << seed << ", scale " << placed.scale;
    }
  }
}

// The vertices are far from the origin of the mesh axes, and the instance's translation cancels that offset.
TEST(QueryWatertightTest, NoRayLeaksFromAMeshFarFromItsOwnOrigin) {
  constexpr uint64_t kSeed = 71;
  for (const double offset : {1e3, 1e5}) {
    std::vector<Triangle> sphere = bumpy_sphere(16, 0.1, kSeed);
    const Vec3d shift = {offset, -offset, offset};
    for (Triangle& triangle : sphere)
      for (Vec3f* vertex : {&triangle.a, &triangle.b, &triangle.c}) *vertex = to_float(to_double(*vertex) + shift);
    QueryWorld world;
    world.instances = {placed(1, mesh_of(sphere), -shift)};
    OwnedBlock block = rays_along_x(RayMode::kFirst, {});
    block.sizes.clear();
    for (const Triangle& triangle : sphere) {
      for (const Vec3f vertex : {triangle.a, triangle.b, triangle.c}) {
        const Vec3f direction = to_float(to_double(vertex) - shift);
        block.points.insert(block.points.end(), {0, 0, 0});
        block.sizes.insert(block.sizes.end(), {direction.x, direction.y, direction.z});
      }
    }
    EXPECT_EQ(leaks(*snapshot_of(world), block), 0u) << offset;
  }
}

}  // namespace
}  // namespace locus::test
