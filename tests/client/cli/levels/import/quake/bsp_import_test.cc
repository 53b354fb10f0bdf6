#include "client/cli/levels/import/quake/bsp_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "client/cli/levels/generate/splitmix64.h"
#include "client/cli/levels/import/import_limits.h"
#include "client/cli/levels/import/quake/bsp_file.h"
#include "tests/client/cli/levels/import/quake/bsp_writer.h"

namespace locus::cli {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

std::string message(const BspWriter& level) {
  return std::string(import_bsp(level.bytes(), "level", {}).status().message());
}

// Returns twice the signed area of triangle `t` as seen from +z: positive if the triangle is counter-clockwise.
double area_from_above(const ImportedMesh& mesh, size_t t) {
  const auto at = [&](size_t corner, size_t axis) -> double {
    return mesh.vertices[3 * mesh.indices[3 * t + corner] + axis];
  };
  return (at(1, 0) - at(0, 0)) * (at(2, 1) - at(0, 1)) - (at(1, 1) - at(0, 1)) * (at(2, 0) - at(0, 0));
}

TEST(BspImportTest, PolygonsMeshesAndPatchesComeInFileOrderFacingOut) {
  const auto level = import_bsp(small_level().bytes(), "level", {});
  ASSERT_TRUE(level.ok()) << level.status();
  expect_sound(*level);
  const ImportedMesh& mesh = level->meshes.at(0);
  EXPECT_EQ(mesh.name, "level");
  EXPECT_EQ(level->source_format, "Quake 3 BSP");
  ASSERT_EQ(mesh.indices.size() / 3, 2u + 1u + 72u);
  double area = 0;
  for (size_t t = 0; t < mesh.indices.size() / 3; ++t) {
    EXPECT_GT(area_from_above(mesh, t), 0) << t;
    area += area_from_above(mesh, t) / 2;
  }
  EXPECT_DOUBLE_EQ(area, 64 + 8 + 36);
  EXPECT_EQ(mesh.vertices[3 * mesh.indices[0] + 2], 0);
  EXPECT_EQ(mesh.vertices[3 * mesh.indices[6] + 2], 1);
  EXPECT_EQ(mesh.vertices[3 * mesh.indices[9] + 2], 2);
}

TEST(BspImportTest, PartsAreRunsOfOneTexture) {
  const auto level = import_bsp(small_level().bytes(), "level", {});
  ASSERT_TRUE(level.ok()) << level.status();
  const std::vector<MeshPart>& parts = level->meshes.at(0).parts;
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].name, "textures/floor");
  EXPECT_EQ(parts[1].name, "models/crate");
  EXPECT_EQ(parts[1].first_triangle, 2u);
  EXPECT_EQ(parts[2].name, "textures/floor");
  EXPECT_EQ(parts[2].first_triangle, 3u);
}

TEST(BspImportTest, BillboardsAreSkippedAndNoted) {
  const auto level = import_bsp(small_level().bytes(), "level", {});
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_THAT(level->notes, Contains("1 billboards were skipped."));
}

TEST(BspImportTest, SubdivisionsAndScaleAreApplied) {
  const auto level = import_bsp(small_level().bytes(), "level", {.entry = "", .patch_subdivisions = 1, .scale = 0.5});
  ASSERT_TRUE(level.ok()) << level.status();
  const ImportedMesh& mesh = level->meshes.at(0);
  EXPECT_EQ(mesh.indices.size() / 3, 2u + 1u + 2u);
  EXPECT_EQ(mesh.vertices[3 * mesh.indices[9] + 2], 1);
}

TEST(BspImportTest, AnotherFormatOrVersionIsNamed) {
  EXPECT_THAT(std::string(import_bsp("VBSP", "level", {}).status().message()), HasSubstr("not a Quake 3 level"));
  BspWriter level = small_level();
  level.version = 38;
  EXPECT_THAT(message(level), HasSubstr("IBSP version 38"));
}

TEST(BspImportTest, EveryTruncationIsRefusedOrGivesAValidMesh) {
  const std::string whole = small_level().bytes();
  for (size_t size = 0; size < whole.size(); ++size) {
    ASSERT_EQ(import_bsp(whole.substr(0, size), "level", {}).status().code(), absl::StatusCode::kInvalidArgument)
        << size;
  }
}

TEST(BspImportTest, EveryLumpOutsideTheFileIsNamedByNumber) {
  const std::string whole = small_level().bytes();
  for (size_t lump = 0; lump < 17; ++lump) {
    for (size_t field : {size_t{0}, size_t{4}}) {
      for (uint32_t value : {static_cast<uint32_t>(whole.size()) + 1, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
        std::string bytes = whole;
        std::string replacement;
        append_u32(replacement, value);
        bytes.replace(8 + 8 * lump + field, 4, replacement);
        EXPECT_THAT(std::string(import_bsp(bytes, "level", {}).status().message()),
                    HasSubstr("lump " + std::to_string(lump) + " "));
      }
    }
  }
}

TEST(BspImportTest, ALumpOfBrokenElementsIsRefused) {
  for (size_t lump : {1, 10, 11, 13}) {
    std::string bytes = small_level().bytes();
    bytes[12 + 8 * lump] = static_cast<char>(bytes[12 + 8 * lump] - 1);
    EXPECT_THAT(std::string(import_bsp(bytes, "level", {}).status().message()), HasSubstr("no multiple of")) << lump;
  }
}

TEST(BspImportTest, WrongFacesAreNamedByIndex) {
  const auto broken = [](size_t face, auto change) {
    BspWriter level = small_level();
    change(level.faces[face]);
    return message(level);
  };
  EXPECT_THAT(broken(0, [](BspWriterFace& f) { f.type = 9; }), HasSubstr("faces[0]: face type 9"));
  EXPECT_THAT(broken(0, [](BspWriterFace& f) { f.texture = 2; }), HasSubstr("faces[0]: texture 2 of 2"));
  EXPECT_THAT(broken(3, [](BspWriterFace& f) { f.texture = UINT32_MAX; }), HasSubstr("faces[3]: texture"));
  EXPECT_THAT(broken(1, [](BspWriterFace& f) { f.first_vertex = 14; }), HasSubstr("faces[1]: vertices 14 + 3 of 16"));
  EXPECT_THAT(broken(1, [](BspWriterFace& f) { f.first_vertex = UINT32_MAX; }), HasSubstr("faces[1]: vertices"));
  EXPECT_THAT(broken(0, [](BspWriterFace& f) { f.first_meshvert = 4; }), HasSubstr("faces[0]: meshverts 4 + 6 of 9"));
  EXPECT_THAT(broken(0, [](BspWriterFace& f) { f.meshvert_count = 5; }), HasSubstr("no whole triangles"));
  EXPECT_THAT(broken(2, [](BspWriterFace& f) { f.width = 9, f.height = 1; }), HasSubstr("faces[2]: a patch of 9 x 1"));
  EXPECT_THAT(broken(2, [](BspWriterFace& f) { f.vertex_count = 8; }), HasSubstr("faces[2]: a patch"));
  EXPECT_THAT(broken(2, [](BspWriterFace& f) { f.width = 0x10003, f.height = 0x10003; }),
              HasSubstr("faces[2]: a patch"));
}

TEST(BspImportTest, AMeshvertOutsideItsFaceIsNamed) {
  BspWriter level = small_level();
  level.meshverts[7] = 3;
  EXPECT_THAT(message(level), HasSubstr("meshverts[7]: vertex 3 of the 3 of faces[1]"));
}

TEST(BspImportTest, AVertexThatIsNotFiniteIsNamed) {
  for (float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    BspWriter level = small_level();
    level.vertices[5][1] = bad;
    EXPECT_THAT(message(level), HasSubstr("vertices[5]: the position is not finite"));
  }
}

TEST(BspImportTest, ALevelWithoutTrianglesIsRefused) {
  BspWriter level = small_level();
  level.faces.clear();
  EXPECT_THAT(message(level), HasSubstr("no triangle"));
}

TEST(BspImportTest, FacesThatRepeatTheSameTrianglesTooOftenAreRefused) {
  BspWriter level;
  level.textures = {"t"};
  level.vertices = {{0, 0, 0}};
  level.meshverts.assign(3 * 4096, 0);
  level.faces.assign(kMaxBspTriangles / 4096 + 1, {.type = 3, .vertex_count = 1, .meshvert_count = 3 * 4096});
  const auto result = import_bsp(level.bytes(), "level", {});
  EXPECT_EQ(result.status().code(), absl::StatusCode::kResourceExhausted) << result.status();
}

TEST(BspImportTest, RandomMutationsAreRefusedOrGiveAValidMesh) {
  constexpr uint64_t kSeed = 7;
  SplitMix64 random(kSeed);
  const std::string whole = small_level().bytes();
  int sound = 0;
  for (int round = 0; round < 4000; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << " round " << round);
    std::string bytes = whole;
    const uint32_t changes = 1 + random.below(4);
    for (uint32_t i = 0; i < changes; ++i) {
      const size_t at = random.below(static_cast<uint32_t>(bytes.size()));
      // Half of the values are small, because small values pass more checks than random bytes, so that later checks are
      // tested too.
      bytes[at] = static_cast<char>(random.below(2) == 0 ? random.next() : random.below(20));
    }
    const auto level = import_bsp(bytes, "level", {});
    if (!level.ok()) continue;
    ++sound;
    ASSERT_NO_FATAL_FAILURE(expect_sound(*level));
  }
  EXPECT_GT(sound, 200) << "seed " << kSeed;
  EXPECT_LT(sound, 3800) << "seed " << kSeed;
}

}  // namespace
}  // namespace locus::cli
