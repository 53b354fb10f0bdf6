// Tests rays that the kernels trace in several chunks: compares their results with tests of every triangle of every
// instance.
#include "core/query/kinds/kernel_rays.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/index/bvh/kernels/dispatch.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

constexpr size_t kRays = 700;  // so many that they form several chunks, of which the last is not full

// Returns a world of forty instances of three meshes; the instances are rotated and scaled and overlap each other.
QueryWorld crowd() {
  Random random(1);
  const StaticMeshPtr meshes[] = {mesh_of(bumpy_sphere(8, 0.1, 1)), mesh_of(bumpy_sphere(5, 0.2, 2)),
                                  mesh_of(box_city(2, 1))};
  QueryWorld world;
  for (Id id = 1; id <= 40; ++id) {
    PlacedMesh placed;
    placed.id = id;
    placed.mesh = meshes[id % 3];
    placed.translation = random.vector(12);
    if (id % 4 != 0) placed.rotation = random.rotation();
    if (id % 5 == 0) placed.scale = 0.5f;
    if (id % 7 == 0) placed.layers = 2;
    world.instances.push_back(placed);
  }
  return world;
}

OwnedBlock rays_through(RayMode mode) {
  Random random(2);
  OwnedBlock block = rays_along_x(mode, {});
  block.sizes.clear();
  for (size_t i = 0; i < kRays; ++i) {
    const Vec3f origin = to_float(random.vector(20)), direction = to_float(random.unit_vector());
    block.points.insert(block.points.end(), {origin.x, origin.y, origin.z});
    block.sizes.insert(block.sizes.end(), {direction.x, direction.y, direction.z});
    block.extras.push_back(random.chance(0.3) ? 9.0f : 100.0f);
    block.masks.push_back(random.chance(0.3) ? 1u : 3u);
  }
  return block;
}

class KernelRaysTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(use_instruction_set(GetParam()).ok()); }
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }
};

TEST_P(KernelRaysTest, FirstHitsEqualThoseOfBruteForce) {
  const SnapshotPtr snapshot = snapshot_of(crowd());
  const OwnedBlock rays = rays_through(RayMode::kFirst);
  RunOptions every_triangle;
  every_triangle.brute_force = true;
  EXPECT_EQ(difference(run_block(*snapshot, rays), run_block(*snapshot, rays, every_triangle)), "");
}

TEST_P(KernelRaysTest, AnyHitsEqualThoseOfBruteForce) {
  const SnapshotPtr snapshot = snapshot_of(crowd());
  const OwnedBlock rays = rays_through(RayMode::kAny);
  RunOptions every_triangle;
  every_triangle.brute_force = true;
  EXPECT_EQ(run_block(*snapshot, rays).hits, run_block(*snapshot, rays, every_triangle).hits);
}

TEST_P(KernelRaysTest, AllHitsAndTruncatedHitsEqualThoseOfBruteForce) {
  const SnapshotPtr snapshot = snapshot_of(crowd());
  RunOptions every_triangle;
  every_triangle.brute_force = true;
  for (const uint32_t most : {1u, 4u, limits::kDefaultMaxResults}) {
    OwnedBlock rays = rays_through(RayMode::kAll);
    rays.settings.max_results = most;
    EXPECT_EQ(difference(run_block(*snapshot, rays), run_block(*snapshot, rays, every_triangle)), "") << most;
  }
}

// The ray has more hits in one mesh than the kernels return for one ray.
TEST_P(KernelRaysTest, AllHitsOfARayThroughManyTrianglesOfOneMeshAreFound) {
  constexpr uint32_t kWalls = 500;
  std::vector<Triangle> walls;
  for (uint32_t i = 0; i < kWalls; ++i) walls.push_back(wall_triangle(static_cast<float>(i)));
  number_in_order(walls);
  QueryWorld world;
  world.instances = {placed(1, mesh_of(walls))};
  const BlockResult result = run_block(*snapshot_of(world), one_ray(RayMode::kAll, {-1, 0, 0}, {1, 0, 0}));
  EXPECT_THAT(result.truncated, ::testing::IsEmpty());
  ASSERT_EQ(result.triangles.size(), kWalls);
  for (uint32_t i = 0; i < kWalls; ++i) EXPECT_EQ(result.triangles[i], i);
}

TEST_P(KernelRaysTest, AnExhaustedBudgetListsTheUnansweredRays) {
  const SnapshotPtr snapshot = snapshot_of(crowd());
  const std::vector<OwnedBlock> blocks = {rays_through(RayMode::kFirst)};
  QueryBatch batch = batch_of(blocks);
  batch.max_work = 1;
  const absl::StatusOr<BatchResult> result = run_batch(*snapshot, batch, {});
  ASSERT_TRUE(result.ok()) << result.status();
  const std::vector<uint32_t>& truncated = result->blocks[0].truncated;
  ASSERT_FALSE(truncated.empty());
  EXPECT_EQ(truncated.back(), kRays - 1);
  EXPECT_TRUE(std::is_sorted(truncated.begin(), truncated.end()));
  EXPECT_EQ(std::adjacent_find(truncated.begin(), truncated.end()), truncated.end());
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, KernelRaysTest, ::testing::ValuesIn(instruction_sets()));

}  // namespace
}  // namespace locus::test
