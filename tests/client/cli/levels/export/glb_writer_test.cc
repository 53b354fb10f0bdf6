#include "client/cli/levels/export/glb_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "client/cli/levels/export/unit_shapes.h"
#include "client/cli/levels/import/import_file.h"
#include "tests/client/cli/levels/export/glb_file.h"

namespace locus::cli {
namespace {

using testing::expect_valid;
using testing::GlbFile;
using ::testing::HasSubstr;
using testing::read_glb;

class GlbWriterTest : public ::testing::Test {
 protected:
  ~GlbWriterTest() override { unlink(path_.c_str()); }

  GlbFile written(const GlbWriter& writer) {
    const absl::StatusOr<uint64_t> bytes = writer.write(path_);
    EXPECT_TRUE(bytes.ok()) << bytes.status();
    GlbFile file = read_glb(path_);
    expect_valid(file);
    return file;
  }

  // Reads the written file with the importer.
  ImportedLevel imported() {
    absl::StatusOr<ImportedLevel> level = import_file(path_, {});
    EXPECT_TRUE(level.ok()) << level.status();
    return level.ok() ? *std::move(level) : ImportedLevel();
  }

  const std::string path_ = ::testing::TempDir() + "glb_writer_test_" + std::to_string(getpid()) + ".glb";
};

// Returns two triangles with a common edge, in two parts, and one unused vertex.
ImportedMesh two_parts() {
  ImportedMesh mesh;
  mesh.name = "walls";
  mesh.vertices = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 9, 9, 9};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  mesh.parts = {{"red", 0}, {"blue", 1}};
  return mesh;
}

TEST_F(GlbWriterTest, AMeshDrawnByTwoNodesIsWrittenOnce) {
  GlbWriter writer("arena", UpAxis::kY);
  const size_t mesh = writer.reserve_mesh();
  for (int i = 0; i < 3; ++i) {
    GlbPlace place;
    place.translation = {static_cast<float>(i), 0.25f, -3};
    ASSERT_TRUE(writer.add_node("box " + std::to_string(i), place, mesh, {{"id", "7"}}).ok());
  }
  ASSERT_TRUE(writer.set_mesh(mesh, unit_box()).ok());
  const GlbFile file = written(writer);
  EXPECT_EQ(file.json["meshes"].size(), 1u);
  EXPECT_EQ(file.json["nodes"].size(), 4u);
  EXPECT_EQ(file.json["nodes"][0]["name"], "arena");
  EXPECT_EQ(file.node("box 2")["translation"], Json({2, 0.25, -3}));
  EXPECT_EQ(file.node("box 2")["extras"]["id"], "7");
  EXPECT_EQ(imported().meshes[0].indices.size(), 3u * 36);
}

TEST_F(GlbWriterTest, PartsArePrimitivesWithTheirOwnVerticesAndAMaterialOfTheirName) {
  GlbWriter writer("arena", UpAxis::kY);
  const size_t mesh = writer.reserve_mesh();
  ASSERT_TRUE(writer.add_node("walls", {}, mesh, Json::object()).ok());
  ASSERT_TRUE(writer.set_mesh(mesh, two_parts()).ok());
  const GlbFile file = written(writer);
  const Json& primitives = file.json["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 2u);
  for (size_t part = 0; part < 2; ++part) {
    EXPECT_EQ(file.column<float>(primitives[part]["attributes"]["POSITION"].get<size_t>()).size(), 9u);
    EXPECT_EQ(file.json["materials"][primitives[part]["material"].get<size_t>()]["name"], part == 0 ? "red" : "blue");
  }
  EXPECT_EQ(file.column<float>(primitives[1]["attributes"]["POSITION"].get<size_t>()),
            (std::vector<float>{0, 0, 0, 1, 1, 0, 0, 1, 0}));
  EXPECT_EQ(file.column<uint32_t>(primitives[1]["indices"].get<size_t>()), (std::vector<uint32_t>{0, 1, 2}));
}

TEST_F(GlbWriterTest, AMeshOfTooManyPartsIsWrittenAsOne) {
  ImportedMesh mesh;
  mesh.name = "many";
  mesh.vertices = {0, 0, 0, 1, 0, 0, 1, 1, 0};
  for (uint32_t part = 0; part <= kMaxExportParts; ++part) {
    mesh.indices.insert(mesh.indices.end(), {0, 1, 2});
    mesh.parts.push_back({"part", part});
  }
  GlbWriter writer("arena", UpAxis::kY);
  const size_t number = writer.reserve_mesh();
  ASSERT_TRUE(writer.add_node("many", {}, number, Json::object()).ok());
  ASSERT_TRUE(writer.set_mesh(number, mesh).ok());
  const GlbFile file = written(writer);
  EXPECT_EQ(file.json["meshes"][0]["primitives"].size(), 1u);
  EXPECT_EQ(file.triangles(0), kMaxExportParts + 1);
}

// Reads the file without the importer, because assimp 5.2.5 drops small differences: transforms within 0.01 of the
// identity, and distances of vertices below 1e-5.
TEST_F(GlbWriterTest, SmallDifferencesAreKept) {
  ImportedMesh tiny = unit_box();
  for (float& coordinate : tiny.vertices) coordinate *= 1e-7f;
  GlbWriter writer("arena", UpAxis::kY);
  const size_t mesh = writer.reserve_mesh();
  GlbPlace place;
  place.translation = {0.005f, 0, 0};
  place.scale = {1.004f, 1.004f, 1.004f};
  ASSERT_TRUE(writer.add_node("near", place, mesh, Json::object()).ok());
  ASSERT_TRUE(writer.set_mesh(mesh, tiny).ok());
  const GlbFile file = written(writer);
  EXPECT_EQ(file.node("near")["translation"][0].get<float>(), 0.005f);
  EXPECT_EQ(file.node("near")["scale"][0].get<float>(), 1.004f);
  EXPECT_EQ(file.column<float>(0).size(), 24u);
  EXPECT_EQ(std::abs(file.column<float>(0)[3]), 1e-7f);
}

TEST_F(GlbWriterTest, IndicesBeyondSixteenBitsAreKept) {
  ImportedMesh strip;
  strip.name = "strip";
  constexpr uint32_t kVertices = 100'000;
  for (uint32_t i = 0; i < kVertices; ++i)
    strip.vertices.insert(strip.vertices.end(), {static_cast<float>(i / 2), static_cast<float>(i % 2), 0});
  for (uint32_t i = 0; i + 2 < kVertices; ++i) strip.indices.insert(strip.indices.end(), {i, i + 1, i + 2});
  GlbWriter writer("arena", UpAxis::kY);
  const size_t mesh = writer.reserve_mesh();
  ASSERT_TRUE(writer.add_node("strip", {}, mesh, Json::object()).ok());
  ASSERT_TRUE(writer.set_mesh(mesh, strip).ok());
  EXPECT_EQ(written(writer).column<uint32_t>(1).back(), kVertices - 1);
  const ImportedLevel level = imported();
  ASSERT_EQ(level.meshes.size(), 1u);
  EXPECT_EQ(level.meshes[0].vertices, strip.vertices);
  EXPECT_EQ(level.meshes[0].indices, strip.indices);
}

TEST_F(GlbWriterTest, AZUpSceneIsRotatedToYUp) {
  ImportedMesh mesh = two_parts();
  mesh.vertices[2] = 5;  // height of the first vertex
  mesh.vertices[1] = 7;
  GlbWriter writer("arena", UpAxis::kZ);
  const size_t number = writer.reserve_mesh();
  ASSERT_TRUE(writer.add_node("mesh", {}, number, Json::object()).ok());
  ASSERT_TRUE(writer.set_mesh(number, mesh).ok());
  written(writer);
  const ImportedLevel level = imported();
  ASSERT_EQ(level.meshes.size(), 1u);
  EXPECT_EQ(std::vector<float>(level.meshes[0].vertices.begin(), level.meshes[0].vertices.begin() + 3),
            (std::vector<float>{0, 5, -7}));
}

TEST_F(GlbWriterTest, NamesOfArbitraryBytesGiveValidJson) {
  ImportedMesh mesh = two_parts();
  mesh.parts = {{"quote\" \\ \n \xff\xfe", 0}, {"\xc3\xa9", 1}};
  GlbWriter writer("arena", UpAxis::kY);
  const size_t number = writer.reserve_mesh();
  ASSERT_TRUE(writer.add_node("twice", {}, number, Json::object()).ok());
  ASSERT_TRUE(writer.add_node("twice", {}, number, Json::object()).ok());
  ASSERT_TRUE(writer.set_mesh(number, mesh).ok());
  const GlbFile file = written(writer);
  EXPECT_EQ(file.json["materials"][1]["name"], "\xc3\xa9");
  EXPECT_EQ(imported().meshes[0].indices.size(), 12u);
}

TEST_F(GlbWriterTest, TooManyNodesAreRefusedNamingTheLimit) {
  GlbWriter writer("arena", UpAxis::kY);
  const size_t mesh = writer.reserve_mesh();
  // The root and the group are nodes too, so these children are one too many.
  const std::vector<GlbWriter::Child> children(kMaxExportNodes - 1, {mesh, {}});
  const absl::Status status = writer.add_group("", {}, children, Json::object());
  EXPECT_TRUE(absl::IsResourceExhausted(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("1048576 nodes (export_nodes)"));
  EXPECT_EQ(writer.node_count(), 1u);
  EXPECT_TRUE(writer.add_node("", {}, mesh, Json::object()).ok());
}

TEST_F(GlbWriterTest, AFailedWriteNamesThePathAndLeavesNoFile) {
  GlbWriter writer("arena", UpAxis::kY);
  const size_t mesh = writer.reserve_mesh();
  ASSERT_TRUE(writer.set_mesh(mesh, unit_box()).ok());
  const absl::Status status = writer.write("/nonexistent/folder/out.glb").status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("cannot write /nonexistent/folder/out.glb: check its folder"));
  const std::string folder = ::testing::TempDir();
  EXPECT_TRUE(absl::IsFailedPrecondition(writer.write(folder).status())) << "a folder is no file";
  EXPECT_NE(access((folder + ".unfinished").c_str(), F_OK), 0);
}

}  // namespace
}  // namespace locus::cli
