#include "client/cli/levels/import/scene_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "client/cli/levels/generate/splitmix64.h"
#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

absl::StatusOr<ImportedLevel> import_text(const std::string& name, const std::string& text,
                                          const ImportOptions& options = {}) {
  const TempFolder folder;
  absl::StatusOr<ImportedLevel> level = import_file(folder.write(name, text), options);
  if (level.ok()) expect_sound(*level);
  return level;
}

std::array<float, 3> corner(const ImportedMesh& mesh, size_t triangle, size_t number) {
  const size_t at = 3 * mesh.indices.at(3 * triangle + number);
  return {mesh.vertices.at(at), mesh.vertices.at(at + 1), mesh.vertices.at(at + 2)};
}

// Returns a binary glTF file with one triangle (0,0,0) (1,0,0) (0,1,0). `nodes` are the nodes in JSON, `scene_nodes`
// the indices of the scene's root nodes.
std::string glb(const std::string& nodes, const std::string& scene_nodes) {
  std::string data;
  for (float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) append_f32(data, value);
  for (uint32_t index : {0u, 1u, 2u}) append_u32(data, index);
  std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + scene_nodes + R"(]}],"nodes":[)" +
                     nodes +
                     R"(],"meshes":[{"name":"tri","primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
                     R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],)"
                     R"("max":[1,1,0]},{"bufferView":1,"componentType":5125,"count":3,"type":"SCALAR"}],)"
                     R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},)"
                     R"({"buffer":0,"byteOffset":36,"byteLength":12}],"buffers":[{"byteLength":48}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  append_u32(bytes, 2);
  append_u32(bytes, static_cast<uint32_t>(12 + 8 + json.size() + 8 + data.size()));
  append_u32(bytes, static_cast<uint32_t>(json.size()));
  bytes += "JSON" + json;
  append_u32(bytes, static_cast<uint32_t>(data.size()));
  bytes += std::string("BIN\0", 4) + data;
  return bytes;
}

TEST(SceneImportTest, ObjPolygonsAreCutAndObjectsBecomeParts) {
  const auto level = import_text("yard.obj",
                                 "o floor\nv 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nf 1 2 3 4\n"
                                 "o wall\nv 0 0 5\nf 1 2 5\n");
  ASSERT_TRUE(level.ok()) << level.status();
  const ImportedMesh& mesh = level->meshes.at(0);
  EXPECT_EQ(mesh.name, "yard");
  EXPECT_EQ(level->source_format, "OBJ");
  EXPECT_EQ(mesh.indices.size(), 9u);
  EXPECT_EQ(mesh.vertices.size(), 15u);  // 5 vertices, which the two parts share
  ASSERT_EQ(mesh.parts.size(), 2u);
  EXPECT_EQ(mesh.parts[0].name, "floor");
  EXPECT_EQ(mesh.parts[1].name, "wall");
  EXPECT_EQ(mesh.parts[1].first_triangle, 2u);
  EXPECT_THAT(level->recentre, ElementsAre(0, 0, 0));
}

TEST(SceneImportTest, AConcavePolygonKeepsItsArea) {
  const auto level = import_text("l.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n");
  ASSERT_TRUE(level.ok()) << level.status();
  const ImportedMesh& mesh = level->meshes.at(0);
  ASSERT_EQ(mesh.indices.size() / 3, 4u);
  double area = 0;
  for (size_t t = 0; t < 4; ++t) {
    const auto a = corner(mesh, t, 0), b = corner(mesh, t, 1), c = corner(mesh, t, 2);
    area += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
  }
  EXPECT_EQ(area, 3);
}

TEST(SceneImportTest, LinesAreSkippedAndNoted) {
  const auto level = import_text("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\n");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->meshes.at(0).indices.size(), 3u);
  EXPECT_THAT(level->notes, Contains("1 points and lines were skipped."));
}

TEST(SceneImportTest, ObjWithBadNumbersIsRefused) {
  EXPECT_FALSE(import_text("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").ok());
  const auto level = import_text("a.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_THAT(std::string(level.status().message()), HasSubstr("vertex 0 is not finite"));
}

TEST(SceneImportTest, PlyIsReadInAsciiAndBinary) {
  const auto header = [](const std::string& format) {
    return "ply\nformat " + format + " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n" +
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  };
  std::string binary = header("binary_little_endian");
  for (float value : {0.f, 0.f, 0.f, 2.f, 0.f, 0.f, 2.f, 2.f, 0.f, 0.f, 2.f, 0.f}) append_f32(binary, value);
  binary.push_back(4);
  for (uint32_t index : {0u, 1u, 2u, 3u}) append_u32(binary, index);
  const std::string ascii = header("ascii") + "0 0 0\n2 0 0\n2 2 0\n0 2 0\n4 0 1 2 3\n";
  for (const std::string& bytes : {ascii, binary}) {
    const auto level = import_text("q.ply", bytes);
    ASSERT_TRUE(level.ok()) << level.status();
    EXPECT_EQ(level->source_format, "PLY");
    EXPECT_EQ(level->meshes.at(0).indices.size(), 6u);
    EXPECT_EQ(level->meshes.at(0).vertices.size(), 12u);
  }
}

TEST(SceneImportTest, PlyIndicesOutOfRangeAreRefused) {
  const auto level =
      import_text("q.ply",
                  "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                  "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                  "0 0 0\n1 0 0\n0 1 0\n3 0 1 33\n");
  EXPECT_THAT(std::string(level.status().message()), HasSubstr("face 0 names vertex 33 of 3"));
}

TEST(SceneImportTest, PlyFacesThatTheParserMissesAreRefused) {
  const auto level = import_text("q.ply",
                                 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                 "property float z\nelement face 1\nproperty list uchar int corners\nend_header\n"
                                 "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_THAT(std::string(level.status().message()), HasSubstr("declares 1 faces, but 0 were read"));
}

TEST(SceneImportTest, StlIsReadInAsciiAndBinary) {
  std::string binary(80, ' ');
  append_u32(binary, 2);
  for (float z : {0.f, 1.f}) {
    for (float value : {0.f, 0.f, 1.f, 0.f, 0.f, z, 1.f, 0.f, z, 0.f, 1.f, z}) append_f32(binary, value);
    binary.append(2, '\0');
  }
  std::string ascii = "solid two\n";
  for (const char* z : {"0", "1"}) {
    ascii += std::string("facet normal 0 0 1\nouter loop\nvertex 0 0 ") + z + "\nvertex 1 0 " + z + "\nvertex 0 1 " +
             z + "\nendloop\nendfacet\n";
  }
  ascii += "endsolid two\n";
  for (const std::string& bytes : {binary, ascii}) {
    const auto level = import_text("s.stl", bytes);
    ASSERT_TRUE(level.ok()) << level.status();
    EXPECT_EQ(level->source_format, "STL");
    const ImportedMesh& mesh = level->meshes.at(0);
    ASSERT_EQ(mesh.indices.size(), 6u);
    EXPECT_THAT(corner(mesh, 1, 1), ElementsAre(1, 0, 1));
  }
  EXPECT_FALSE(import_text("s.stl", binary.substr(0, binary.size() - 30)).ok());
}

TEST(SceneImportTest, NodeTransformsAreBakedDownTheTree) {
  const auto level =
      import_text("n.glb", glb(R"({"name":"outer","translation":[10,0,0],"scale":[2,2,2],"children":[1]},)"
                               R"({"name":"inner","translation":[0,0,3],"mesh":0})",
                               "0"));
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->source_format, "GLB");
  const ImportedMesh& mesh = level->meshes.at(0);
  ASSERT_EQ(mesh.indices.size(), 3u);
  EXPECT_THAT(corner(mesh, 0, 0), ElementsAre(10, 0, 6));
  EXPECT_THAT(corner(mesh, 0, 1), ElementsAre(12, 0, 6));
  EXPECT_THAT(corner(mesh, 0, 2), ElementsAre(10, 2, 6));
}

TEST(SceneImportTest, AMirroringNodeReversesItsTriangles) {
  const auto level = import_text("m.glb", glb(R"({"name":"mirror","scale":[-1,1,1],"mesh":0})", "0"));
  ASSERT_TRUE(level.ok()) << level.status();
  const ImportedMesh& mesh = level->meshes.at(0);
  EXPECT_THAT(corner(mesh, 0, 1), ElementsAre(0, 1, 0));
  EXPECT_THAT(corner(mesh, 0, 2), ElementsAre(-1, 0, 0));
}

TEST(SceneImportTest, EachNodeIsAPartAndSharedMeshesAreRepeated) {
  const auto level =
      import_text("p.glb", glb(R"({"name":"a","mesh":0},{"name":"b","translation":[0,0,1],"mesh":0})", "0,1"));
  ASSERT_TRUE(level.ok()) << level.status();
  const ImportedMesh& mesh = level->meshes.at(0);
  ASSERT_EQ(mesh.parts.size(), 2u);
  EXPECT_THAT(mesh.parts[0].name, HasSubstr("a"));
  EXPECT_THAT(mesh.parts[1].name, HasSubstr("b"));
  EXPECT_EQ(mesh.parts[1].first_triangle, 1u);
}

TEST(SceneImportTest, AFarNodeIsRecentredWithoutLosingItsShape) {
  const auto level = import_text("f.glb", glb(R"({"name":"far","translation":[4500000,0,-800000],"mesh":0})", "0"));
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_THAT(level->recentre, ElementsAre(4500000.5, 0.5, -800000));
  EXPECT_THAT(corner(level->meshes.at(0), 0, 1), ElementsAre(0.5f, -0.5f, 0));
  EXPECT_THAT(level->notes, Contains(HasSubstr("32-bit floats")));
}

TEST(SceneImportTest, ScaleMultipliesEveryCoordinate) {
  const auto level = import_text("a.obj", "v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n", {.entry = "", .scale = 0.25});
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_THAT(corner(level->meshes.at(0), 0, 1), ElementsAre(0.5f, 0, 0));
}

TEST(SceneImportTest, TruncatedGlbIsRefused) {
  const std::string whole = glb(R"({"mesh":0})", "0");
  for (size_t size = 1; size < whole.size(); size += 13) {
    EXPECT_FALSE(import_text("t.glb", whole.substr(0, size)).ok()) << size;
  }
}

}  // namespace
}  // namespace locus::cli
