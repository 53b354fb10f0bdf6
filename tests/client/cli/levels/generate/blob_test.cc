#include "client/cli/levels/generate/blob.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/client/cli/levels/generate/mesh_facts.h"
#include "tests/support/small_world.h"

namespace locus::cli {
namespace {

using testing::dot;
using testing::normal;
using testing::Point;
using testing::vertex;

TEST(BlobTest, TheCountIsTheLargestEightTimesASquareWithinTheRequest) {
  for (const uint64_t asked : {8, 9, 31, 32, 71, 72, 5000, 99'999, 1'000'000}) {
    const ImportedMesh mesh = generate_blob(asked, 5);
    const size_t count = mesh.indices.size() / 3;
    const auto f = static_cast<size_t>(std::lround(std::sqrt(static_cast<double>(count) / 8)));
    EXPECT_EQ(count, 8 * f * f) << asked;
    EXPECT_LE(count, asked);
    EXPECT_GT(8 * (f + 1) * (f + 1), asked);
    EXPECT_EQ(mesh.vertices.size() / 3, 4 * f * f + 2);
  }
  for (const uint64_t asked : {0, 1, 7}) EXPECT_EQ(generate_blob(asked, 5).indices.size() / 3, 8u) << asked;
}

TEST(BlobTest, EveryEdgeIsSharedByTwoTrianglesInOppositeDirections) {
  for (const uint64_t asked : {8, 32, 72, 128, 5000, 1'000'000}) {
    const ImportedMesh mesh = generate_blob(asked, 3);
    std::unordered_set<uint64_t> edges;
    EXPECT_EQ(testing::repeated_edges(mesh, edges), 0u) << asked;
    EXPECT_EQ(testing::open_edges(edges), 0u) << asked;
    EXPECT_EQ(edges.size(), mesh.indices.size());
  }
}

TEST(BlobTest, NoVertexIsDuplicatedOrUnused) {
  const ImportedMesh mesh = generate_blob(200'000, 9);
  std::set<Point> points;
  for (uint32_t i = 0; i < mesh.vertices.size() / 3; ++i) points.insert(vertex(mesh, i));
  EXPECT_EQ(points.size(), mesh.vertices.size() / 3);
  const std::set<uint32_t> used(mesh.indices.begin(), mesh.indices.end());
  EXPECT_EQ(used.size(), points.size());
}

TEST(BlobTest, EveryTriangleFacesAwayFromTheOriginAndHasArea) {
  for (const uint64_t seed : {1, 2, 3, 4, 5}) {
    const ImportedMesh mesh = generate_blob(100'000, seed);
    for (size_t triangle = 0; triangle < mesh.indices.size() / 3; ++triangle)
      ASSERT_GT(dot(normal(mesh, triangle), vertex(mesh, mesh.indices[3 * triangle])), 0) << seed << " " << triangle;
  }
}

TEST(BlobTest, EveryVertexIsWithinTheRadiiAndTheSurfaceIsBumpy) {
  const ImportedMesh mesh = generate_blob(100'000, 4);
  double least = kMaxBlobRadius;
  double most = kMinBlobRadius;
  for (uint32_t i = 0; i < mesh.vertices.size() / 3; ++i) {
    const double radius = std::sqrt(dot(vertex(mesh, i), vertex(mesh, i)));
    least = std::min(least, radius);
    most = std::max(most, radius);
  }
  EXPECT_GT(least, kMinBlobRadius);
  EXPECT_LT(most, kMaxBlobRadius);
  EXPECT_GT(most - least, 2);
}

// Casts rays by the server's query code. For every vertex, one ray is aimed at the vertex and one at a point beside it,
// both from points near the origin.
TEST(BlobTest, NoRayFromInsideLeaks) {
  constexpr uint64_t kSeed = 21;
  SCOPED_TRACE(kSeed);
  ImportedMesh blob = generate_blob(20'000, kSeed);
  test::OwnedBlock block = test::rays_along_x(RayMode::kFirst, {});
  block.sizes.clear();
  test::Random random(kSeed);
  for (size_t i = 0; i < blob.vertices.size(); i += 3) {
    for (const double miss : {0.0, 0.01}) {
      const Vec3f origin = to_float(random.vector(1));
      const Vec3d past = random.vector(miss);
      block.points.insert(block.points.end(), {origin.x, origin.y, origin.z});
      for (int axis = 0; axis < 3; ++axis)
        block.sizes.push_back(blob.vertices[i + static_cast<size_t>(axis)] - origin[axis] +
                              static_cast<float>(past[axis]));
    }
  }
  auto mesh = TriangleMesh::create(std::move(blob.vertices), std::move(blob.indices), {});
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->zero_area_count(), 0u);
  test::PlacedMesh placed;
  placed.id = 1;
  placed.mesh = *StaticMesh::build("blob", Sha256{}, *std::move(mesh));
  test::QueryWorld world;
  world.instances = {placed};
  const test::BlockResult result = test::run_block(*test::snapshot_of(world), block);
  ASSERT_EQ(result.ids.size(), block.points.size() / 3);
  EXPECT_EQ(std::count(result.ids.begin(), result.ids.end(), kNoId), 0);
}

TEST(BlobTest, EqualSeedsGiveEqualBytesAndOthersDiffer) {
  EXPECT_EQ(generate_blob(5000, 1).vertices, generate_blob(5000, 1).vertices);
  EXPECT_EQ(generate_blob(5000, 1).indices, generate_blob(5000, 2).indices);
  EXPECT_NE(generate_blob(5000, 1).vertices, generate_blob(5000, 2).vertices);
}

// Golden hash: a difference means that the generated level depends on the machine or changed between versions.
TEST(BlobTest, ItsBytesAreTheSameOnEveryMachine) {
  EXPECT_EQ(testing::bytes_hash(generate_blob(8, 1)),
            "8bbf9c998bc8ea682d60eb4a9ed4cfdcb64594875c32ad6585f28daaa7ddec7e");
  EXPECT_EQ(testing::bytes_hash(generate_blob(5000, 7)),
            "35b6be755bb1cb2c1b59d091bb561402f67a0e82de4683f276de775d070a5417");
}

}  // namespace
}  // namespace locus::cli
