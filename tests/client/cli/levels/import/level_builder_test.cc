#include "client/cli/levels/import/level_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>

#include "client/cli/levels/import/import_limits.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

void add_corner_triangle(LevelBuilder& builder, double x, double y, double z, double size) {
  const uint32_t a = builder.add_vertex({x, y, z});
  const uint32_t b = builder.add_vertex({x + size, y, z});
  const uint32_t c = builder.add_vertex({x, y + size, z});
  builder.add_triangle(a, b, c);
}

TEST(LevelBuilderTest, EqualVerticesAreSharedAndUnusedOnesDropped) {
  LevelBuilder builder(1);
  builder.add_vertex({99, 99, 99});
  add_corner_triangle(builder, 0, 0, 0, 1);
  add_corner_triangle(builder, -0.0, 0, -0.0, 1);
  const auto level = std::move(builder).finish("m");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_THAT(level->meshes.at(0).vertices, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0));
  EXPECT_THAT(level->meshes.at(0).indices, ElementsAre(0, 1, 2, 0, 1, 2));
}

TEST(LevelBuilderTest, VerticesAtAdjacentFloatsAreNotMerged) {
  LevelBuilder builder(1);
  add_corner_triangle(builder, 1, 0, 0, 1);
  add_corner_triangle(builder, std::nextafter(1.0f, 2.0f), 0, 0, 1);
  const auto level = std::move(builder).finish("m");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_THAT(level->meshes.at(0).indices, ElementsAre(0, 1, 2, 3, 1, 4));
}

TEST(LevelBuilderTest, ZeroAreaTrianglesKeepTheirIndices) {
  LevelBuilder builder(1);
  const uint32_t a = builder.add_vertex({0, 0, 0});
  builder.add_triangle(a, a, a);
  add_corner_triangle(builder, 0, 0, 0, 1);
  const auto level = std::move(builder).finish("m");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_THAT(level->meshes.at(0).indices, ElementsAre(0, 0, 0, 0, 1, 2));
}

TEST(LevelBuilderTest, AFileNearTheOriginStaysWhereItIs) {
  LevelBuilder builder(1);
  add_corner_triangle(builder, 7, 0, 0, 1);
  const auto level = std::move(builder).finish("m");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_THAT(level->recentre, ElementsAre(0, 0, 0));
  EXPECT_TRUE(level->notes.empty());
}

TEST(LevelBuilderTest, AFarFileIsMovedInDoubleSoThatNoDetailIsLost) {
  LevelBuilder builder(1);
  add_corner_triangle(builder, 4500000.25, -600000.5, 100, 0.125);
  const auto level = std::move(builder).finish("m");
  ASSERT_TRUE(level.ok()) << level.status();
  const std::vector<float>& vertices = level->meshes.at(0).vertices;
  EXPECT_EQ(vertices[0] + level->recentre[0], 4500000.25);
  EXPECT_EQ(vertices[3] + level->recentre[0], 4500000.375);
  EXPECT_EQ(vertices[7] + level->recentre[1], -600000.375);
  ASSERT_EQ(level->notes.size(), 1u);
  EXPECT_THAT(level->notes[0], HasSubstr("4500000.3125"));
}

TEST(LevelBuilderTest, ScaleIsAppliedBeforeTheBoundsAreChecked) {
  LevelBuilder builder(1e-3);
  add_corner_triangle(builder, 2e9, 0, 0, 4e9);
  const auto level = std::move(builder).finish("m");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_THAT(level->meshes.at(0).vertices, ElementsAre(2e6f, 0, 0, 6e6f, 0, 0, 2e6f, 4e6f, 0));
}

TEST(LevelBuilderTest, CoordinatesBeyondTheLimitOrNotFiniteAreRefused) {
  for (double bad :
       {1.0001e9, -1.0001e9, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    LevelBuilder builder(1);
    add_corner_triangle(builder, 0, 0, bad, 1);
    const auto level = std::move(builder).finish("m");
    EXPECT_EQ(level.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(level.status().message()), HasSubstr("vertex 0"));
  }
}

TEST(LevelBuilderTest, NoTriangleIsRefused) {
  LevelBuilder builder(1);
  builder.add_vertex({0, 0, 0});
  EXPECT_EQ(std::move(builder).finish("m").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(LevelBuilderTest, RoomIsRefusedBeyondTheLimits) {
  const LevelBuilder builder(1);
  EXPECT_TRUE(builder.ensure_room(kMaxImportVertices, kMaxImportTriangles).ok());
  EXPECT_EQ(builder.ensure_room(0, kMaxImportTriangles + 1).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(builder.ensure_room(kMaxImportVertices + 1, 0).code(), absl::StatusCode::kResourceExhausted);
}

TEST(LevelBuilderTest, EmptyPartsVanishAndEqualNeighboursMerge) {
  LevelBuilder builder(1);
  builder.begin_part("empty");
  builder.begin_part("wall");
  add_corner_triangle(builder, 0, 0, 0, 1);
  builder.begin_part("also empty");
  builder.begin_part("wall");
  add_corner_triangle(builder, 1, 0, 0, 1);
  builder.begin_part("roof");
  add_corner_triangle(builder, 2, 0, 0, 1);
  builder.begin_part("last empty");
  const auto level = std::move(builder).finish("m");
  ASSERT_TRUE(level.ok()) << level.status();
  const std::vector<MeshPart>& parts = level->meshes.at(0).parts;
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].name, "wall");
  EXPECT_EQ(parts[0].first_triangle, 0u);
  EXPECT_EQ(parts[1].name, "roof");
  EXPECT_EQ(parts[1].first_triangle, 2u);
}

TEST(LevelBuilderTest, PartsBeyondTheLimitJoinTheLastAndAreNoted) {
  LevelBuilder builder(1);
  for (size_t i = 0; i < kMaxImportParts + 5; ++i) {
    builder.begin_part(std::to_string(i));
    add_corner_triangle(builder, static_cast<double>(i), 0, 0, 1);
  }
  const auto level = std::move(builder).finish("m");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->meshes.at(0).parts.size(), kMaxImportParts);
  EXPECT_EQ(level->meshes.at(0).indices.size(), 3 * (kMaxImportParts + 5));
  ASSERT_EQ(level->notes.size(), 1u);
  EXPECT_THAT(level->notes[0], HasSubstr("4096 parts"));
}

TEST(PartNameTest, PlainNamesStay) { EXPECT_EQ(clean_part_name("textures/base wall-01"), "textures/base wall-01"); }

TEST(PartNameTest, ValidUtf8Stays) {
  for (const char* name : {"T\xC3\xBCr", "\xE5\xA3\x81", "\xF0\x9F\x8F\xA0", "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_EQ(clean_part_name(name), name);
  }
}

TEST(PartNameTest, BrokenUtf8LosesItsHighBytes) {
  EXPECT_EQ(clean_part_name("T\xFCr"), "T_r");               // Latin-1
  EXPECT_EQ(clean_part_name("a\xC0\x80"), "a__");            // overlong
  EXPECT_EQ(clean_part_name("a\xE0\x80\x80"), "a___");       // overlong
  EXPECT_EQ(clean_part_name("a\xED\xA0\x80"), "a___");       // surrogate
  EXPECT_EQ(clean_part_name("a\xF4\x90\x80\x80"), "a____");  // beyond U+10FFFF
  EXPECT_EQ(clean_part_name("a\xE5\xA3"), "a__");            // cut short
  EXPECT_EQ(clean_part_name("a\xF0\x9F\x8F"), "a___");       // cut short
  EXPECT_EQ(clean_part_name("\x80z"), "_z");                 // begins with a continuation byte
}

TEST(PartNameTest, ControlCharactersAreReplaced) { EXPECT_EQ(clean_part_name("a\nb\x1B[31m\x7F"), "a_b_[31m_"); }

TEST(PartNameTest, LongNamesAreTruncatedAtACharacterBoundary) {
  const std::string ascii(kMaxPartNameBytes - 1, 'a');
  EXPECT_EQ(clean_part_name(ascii + "bcd"), ascii + "b");
  EXPECT_EQ(clean_part_name(ascii + "\xC3\xBC"), ascii);
}

}  // namespace
}  // namespace locus::cli
