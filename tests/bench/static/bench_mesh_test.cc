#include "tests/bench/static/bench_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/bench/static/two_sheets.h"

namespace locus::bench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string refusal_of(const std::string& mesh) { return std::string(load_mesh(mesh).status().message()); }

TEST(BenchMeshTest, TrianglesWithoutAreaAreDroppedAndTheRestRenumbered) {
  cli::ImportedMesh mesh;
  mesh.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0};
  mesh.indices = {0, 1, 3, 0, 1, 2};
  const auto result = bench_mesh("name", {mesh});
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->triangles.size(), 1u);
  EXPECT_EQ(result->triangles[0].number, 0u);
  EXPECT_THAT(result->indices, ElementsAre(0, 1, 2));
  EXPECT_EQ(result->bounds.max, (Vec3f{1, 1, 0}));
}

TEST(BenchMeshTest, MeshesOfALevelBecomeOne) {
  cli::ImportedMesh mesh;
  mesh.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  mesh.indices = {0, 1, 2};
  const auto result = bench_mesh("name", {mesh, mesh});
  ASSERT_TRUE(result.ok());
  EXPECT_THAT(result->indices, ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST(BenchMeshTest, AMeshWithoutAnyAreaIsRefused) {
  EXPECT_THAT(std::string(bench_mesh("flat", {}).status().message()), HasSubstr("flat: no triangle has an area"));
}

TEST(BenchMeshTest, AMeshBeyondTheWorldIsRefused) {
  cli::ImportedMesh mesh;
  mesh.vertices = {0, 0, 0, 3e38f, 0, 0, 0, 3e38f, 0};
  mesh.indices = {0, 1, 2};
  EXPECT_THAT(std::string(bench_mesh("far", {mesh}).status().message()), HasSubstr("far: "));
}

TEST(BenchMeshTest, GeneratedMeshesAreNamedByKindSizeAndSeed) {
  EXPECT_EQ(load_mesh("city:2000")->name, "city-2k");
  EXPECT_EQ(load_mesh("terrain:500:3")->name, "terrain-500-3");
  EXPECT_LE(load_mesh("blob:5000")->triangles.size(), 5000u);
}

TEST(BenchMeshTest, AGeneratedMeshOfAWrongNumberIsRefusedWithTheExpectedForm) {
  for (const char* mesh : {"city:", "city:0", "city:many", "city:10:x", "city:10:1:1", "city:999999999999"})
    EXPECT_THAT(refusal_of(mesh), HasSubstr("city:TRIANGLES or city:TRIANGLES:SEED")) << mesh;
}

TEST(BenchMeshTest, AFileIsReadAndNamedWithoutItsFolderAndExtension) {
  const std::string path = testing::TempDir() + "/sheet.obj";
  std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const auto mesh = load_mesh(path);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->name, "sheet");
  EXPECT_EQ(mesh->triangles.size(), 1u);
}

TEST(BenchMeshTest, AMissingFileIsAnErrorThatNamesIt) {
  EXPECT_THAT(refusal_of("/no/such/level.obj"), HasSubstr("/no/such/level.obj"));
}

}  // namespace
}  // namespace locus::bench
