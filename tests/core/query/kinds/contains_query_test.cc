// Contains queries in a small world: a cube from -1 to 1, a ball at (5, 0, 0), a box at (5, 1, 0), and a wall at x = 0.
// The mesh of the wall is not closed.
#include "core/query/kinds/contains_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Returns a cube from -size to size. Its triangles face outwards, or inwards if `inwards` is true.
StaticMeshPtr closed_cube(float size, bool inwards = false) {
  std::vector<Triangle> triangles;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-size, size}) {
      const auto corner = [&](float first, float second) {
        Vec3f vertex;
        vertex[axis] = side;
        vertex[(axis + 1) % 3] = first * size;
        vertex[(axis + 2) % 3] = second * size;
        return vertex;
      };
      Triangle one{corner(-1, -1), corner(1, -1), corner(1, 1)}, two{corner(-1, -1), corner(1, 1), corner(-1, 1)};
      if ((side < 0) != inwards) one = turned_over(one), two = turned_over(two);
      triangles.push_back(one);
      triangles.push_back(two);
    }
  return mesh_of(triangles);
}

SnapshotPtr mesh_and_solids() {
  QueryWorld world;
  world.instances = {placed(10, closed_cube(1)), placed(11, wall_mesh())};
  world.objects = {ball_object(1, {5, 0, 0}), box_object(2, {5, 1, 0})};
  return snapshot_of(world);
}

BlockResult ask(const SnapshotPtr& snapshot, std::vector<float> points, QueryBlock settings = {}) {
  OwnedBlock block;
  block.settings = settings;
  block.settings.kind = ContainsColumns{};
  block.points = std::move(points);
  return run_block(*snapshot, block);
}

TEST(ContainsQueryTest, ObjectsAndClosedMeshesAreInOneOrder) {
  const BlockResult result = ask(mesh_and_solids(), {0, 0.5f, 0, 5, 0.5f, 0, 9, 9, 9});
  EXPECT_THAT(result.counts, ElementsAre(1u, 2u, 0u));
  EXPECT_THAT(result.ids, ElementsAre(10u, 1u, 2u));
}

TEST(ContainsQueryTest, AnOpenMeshContainsNothing) {
  EXPECT_EQ(wall_mesh()->open_edges(), 3u);
  EXPECT_THAT(ask(mesh_and_solids(), {0, -4, 0}).counts, ElementsAre(0u));
}

TEST(ContainsQueryTest, TheSurfaceBelongsToTheMesh) {
  EXPECT_THAT(ask(mesh_and_solids(), {1, 0, 0, 1, 1, 1, 1, 1, 0.5f, 1.0001f, 0, 0}).counts,
              ElementsAre(1u, 1u, 1u, 0u));
}

TEST(ContainsQueryTest, AShellTurnedOverInsideIsACavity) {
  QueryWorld world;
  std::vector<Triangle> shells;
  for (const StaticMeshPtr& mesh : {closed_cube(2), closed_cube(1, true)})
    for (uint32_t i = 0; i < mesh->triangle_count(); ++i) shells.push_back(mesh->triangle(i));
  world.instances = {placed(1, mesh_of(shells))};
  EXPECT_THAT(ask(snapshot_of(world), {0, 0, 0, 1.5f, 0, 0, 1, 0, 0}).counts, ElementsAre(0u, 1u, 1u));
}

TEST(ContainsQueryTest, EitherWindingOfTheWholeIsAccepted) {
  QueryWorld world;
  world.instances = {placed(1, closed_cube(1, true))};
  EXPECT_THAT(ask(snapshot_of(world), {0.5f, 0, 0}).counts, ElementsAre(1u));
}

TEST(ContainsQueryTest, ConservativeTestsTheBoundsOfClosedMeshesAndObjects) {
  QueryWorld world;
  PlacedMesh turned = placed(1, closed_cube(1));
  turned.rotation = {0, 0, 0.38268343f, 0.92387953f};
  world.instances = {turned, placed(2, wall_mesh())};
  world.objects = {ball_object(3, {0, 0, 0}, 1.4f)};
  QueryBlock settings;
  EXPECT_THAT(ask(snapshot_of(world), {1.3f, 1.3f, 0}, settings).ids, IsEmpty());
  settings.precision = Precision::kConservative;
  EXPECT_THAT(ask(snapshot_of(world), {1.3f, 1.3f, 0}, settings).ids, ElementsAre(1u, 3u));
}

TEST(ContainsQueryTest, RestoredAndSharedMeshesAreClosedToo) {
  const StaticMeshPtr cube = closed_cube(1);
  EXPECT_TRUE(cube->is_closed());
  EXPECT_TRUE(StaticMesh::share("other", {}, *cube)->is_closed());
  std::vector<uint32_t> indices;
  PackedIndices::Reader reader = cube->indices();
  for (uint32_t i = 0; i < 3 * cube->triangle_count(); ++i) indices.push_back(reader.next());
  auto mesh = TriangleMesh::create(cube->vertices(), indices, {});
  ASSERT_TRUE(mesh.ok());
  const auto restored = StaticMesh::restore("mesh", Sha256{}, *mesh, cube->tree().topology());
  ASSERT_TRUE(restored.ok());
  EXPECT_TRUE((*restored)->is_closed());
}

}  // namespace
}  // namespace locus::test
