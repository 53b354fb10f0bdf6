#include "client/cli/levels/generate/terrain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/client/cli/levels/generate/mesh_facts.h"

namespace locus::cli {
namespace {

using testing::normal;

TEST(TerrainTest, TheCountIsTheLargestThatItsColumnsAllowWithinTheRequest) {
  for (const uint64_t asked : {2, 3, 4, 5, 7, 8, 18, 5000, 99'999, 1'000'000}) {
    const size_t count = generate_terrain(asked, 5).indices.size() / 3;
    EXPECT_LE(count, asked);
    EXPECT_GT(static_cast<double>(count) + 2 * std::sqrt(static_cast<double>(asked) / 2), static_cast<double>(asked));
  }
  for (const uint64_t asked : {0, 1}) EXPECT_EQ(generate_terrain(asked, 5).indices.size() / 3, 2u) << asked;
}

TEST(TerrainTest, ItIsOneSheetWhoseOnlyOpenEdgesAreItsBorder) {
  const ImportedMesh mesh = generate_terrain(2 * 30 * 31, 3);
  std::unordered_set<uint64_t> edges;
  EXPECT_EQ(testing::repeated_edges(mesh, edges), 0u);
  EXPECT_EQ(testing::open_edges(edges), 2u * (30 + 31));
  EXPECT_EQ(mesh.vertices.size() / 3, 31u * 32);
}

TEST(TerrainTest, EveryTriangleFacesUpAndCoversHalfASquareMetre) {
  const ImportedMesh mesh = generate_terrain(1'000'000, 8);
  for (size_t triangle = 0; triangle < mesh.indices.size() / 3; ++triangle)
    ASSERT_EQ(normal(mesh, triangle)[2], 1) << triangle;
}

TEST(TerrainTest, ItIsCentredOnTheOriginWithinItsHeights) {
  const ImportedMesh mesh = generate_terrain(500'000, 6);
  float low = 0;
  float high = 0;
  float east = 0;
  float west = 0;
  for (size_t i = 0; i < mesh.vertices.size(); i += 3) {
    low = std::min(low, mesh.vertices[i + 2]);
    high = std::max(high, mesh.vertices[i + 2]);
    west = std::min(west, mesh.vertices[i]);
    east = std::max(east, mesh.vertices[i]);
  }
  EXPECT_EQ(west, -250);
  EXPECT_EQ(east, 250);
  EXPECT_GT(low, -kMaxTerrainHeight);
  EXPECT_LT(high, kMaxTerrainHeight);
  EXPECT_GT(high - low, 10) << "hardly any hills";
}

TEST(TerrainTest, NeighbouringHeightsDifferLessThanAtACliff) {
  const ImportedMesh mesh = generate_terrain(200'000, 6);
  for (size_t i = 3; i < mesh.vertices.size(); i += 3) {
    if (mesh.vertices[i] < mesh.vertices[i - 3]) continue;  // the next row begins
    ASSERT_LT(std::abs(mesh.vertices[i + 2] - mesh.vertices[i - 1]), 4);
  }
}

TEST(TerrainTest, EqualSeedsGiveEqualBytesAndOthersDiffer) {
  EXPECT_EQ(generate_terrain(5000, 1).vertices, generate_terrain(5000, 1).vertices);
  EXPECT_EQ(generate_terrain(5000, 1).indices, generate_terrain(5000, 2).indices);
  EXPECT_NE(generate_terrain(5000, 1).vertices, generate_terrain(5000, 2).vertices);
}

// Golden hash: a difference means that the generated level depends on the machine or changed between versions.
TEST(TerrainTest, ItsBytesAreTheSameOnEveryMachine) {
  EXPECT_EQ(testing::bytes_hash(generate_terrain(2, 1)),
            "ce1734c424bfe1a00b762526b5b63066a0f18949885dffaf0838e6327ba22199");
  EXPECT_EQ(testing::bytes_hash(generate_terrain(5000, 7)),
            "ccc7dff36709602fe51aad95b81380f1dda3545309a96aa6aef9b01b6122d02d");
}

}  // namespace
}  // namespace locus::cli
