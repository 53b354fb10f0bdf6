#include "client/cli/levels/import/ply_strips.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/cli/levels/generate/splitmix64.h"
#include "client/cli/levels/import/import_file.h"
#include "client/cli/levels/import/ply_check.h"
#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

// Header of a file with five vertices and one row of strips.
std::string header_of(const std::string& format, const std::string& index_type = "int") {
  return "ply\nformat " + format + " 1.0\ncomment scanned\nelement vertex 5\nproperty float x\nproperty float y\n" +
         "property float z\nelement tristrips 1\nproperty list int " + index_type + " vertex_indices\nend_header\n";
}

const std::string kAscii = header_of("ascii") +
                           "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n"
                           "11 0 1 2 3 -1 2 2 2 3 4 -1\n";

void append_value(std::string& bytes, uint32_t value, bool big_endian) {
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (big_endian ? 24 - 8 * i : 8 * i));
}

std::string binary(bool big_endian, const std::string& index_type = "int") {
  std::string bytes = header_of(big_endian ? "binary_big_endian" : "binary_little_endian", index_type);
  for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 1.f, 1.f, 0.f, 0.f, 2.f, 0.f})
    append_value(bytes, std::bit_cast<uint32_t>(value), big_endian);
  append_value(bytes, 11, big_endian);
  for (const int value : {0, 1, 2, 3, -1, 2, 2, 2, 3, 4, -1})
    append_value(bytes, static_cast<uint32_t>(value), big_endian);
  return bytes;
}

std::string refusal_of(const std::string& bytes) { return std::string(unpack_ply_strips(bytes).status().message()); }

TEST(PlyStripsTest, StripsBecomeFacesOfOneOrientation) {
  const absl::StatusOr<std::optional<std::string>> unpacked = unpack_ply_strips(kAscii);
  ASSERT_TRUE(unpacked.ok() && unpacked->has_value()) << unpacked.status();
  EXPECT_THAT(**unpacked, HasSubstr("element face 3\nproperty list uchar int vertex_indices\nend_header\n"));
  EXPECT_THAT(**unpacked, EndsWith("0 2 0\n3 0 1 2\n3 2 1 3\n3 2 3 4\n"));
  EXPECT_EQ((*unpacked)->find("tristrips"), std::string::npos);
  EXPECT_EQ(check_ply(**unpacked).value(), 3u);
}

TEST(PlyStripsTest, AFileOfStripsIsImported) {
  for (const std::string& bytes : {kAscii, binary(false), binary(true), binary(false, "uint")}) {
    const TempFolder folder;
    const absl::StatusOr<ImportedLevel> level = import_file(folder.write("scan.ply", bytes), {});
    ASSERT_TRUE(level.ok()) << level.status();
    ASSERT_EQ(level->meshes.size(), 1u);
    const ImportedMesh& mesh = level->meshes[0];
    ASSERT_EQ(mesh.indices.size(), 9u);
    std::vector<float> areas;  // signed, in the plane z = 0
    for (size_t triangle = 0; triangle < 3; ++triangle) {
      const auto at = [&](size_t corner, size_t axis) {
        return mesh.vertices[3 * mesh.indices[3 * triangle + corner] + axis];
      };
      areas.push_back((at(1, 0) - at(0, 0)) * (at(2, 1) - at(0, 1)) - (at(2, 0) - at(0, 0)) * (at(1, 1) - at(0, 1)));
    }
    EXPECT_THAT(areas, ElementsAre(1, 1, 1)) << "every triangle is counter-clockwise";
  }
}

TEST(PlyStripsTest, FilesWithoutStripsStayAsTheyAre) {
  std::string faces = kAscii;
  faces.replace(faces.find("tristrips"), 9, "face");
  EXPECT_EQ(unpack_ply_strips(faces).value(), std::nullopt);
}

TEST(PlyStripsTest, DamagedStripsAreRefused) {
  const std::string cut = kAscii.substr(0, kAscii.size() - 4);
  EXPECT_THAT(refusal_of(cut), HasSubstr("tristrips[0] of 1"));
  std::string outside = kAscii;
  outside.replace(outside.rfind("4 -1"), 1, "5");
  EXPECT_THAT(refusal_of(outside), HasSubstr("a triangle strip names vertex 5 of 5"));
  std::string negative = kAscii;
  negative.replace(negative.rfind("4 -1"), 1, "-2");
  EXPECT_THAT(refusal_of(negative), HasSubstr("a triangle strip names vertex -2 of 5"));
  EXPECT_THAT(refusal_of(header_of("ascii", "float") + "0 0 0\n"), HasSubstr("not one list of indices"));
  const std::string whole = binary(false);
  for (size_t missing = 1; missing <= 48; ++missing)
    EXPECT_THAT(refusal_of(whole.substr(0, whole.size() - missing)), HasSubstr("tristrips[0] of 1")) << missing;
}

TEST(PlyStripsTest, RandomMutationsNeverCrash) {
  SplitMix64 random(7);
  for (int round = 0; round < 3000; ++round) {
    std::string bytes = round % 2 == 0 ? kAscii : binary(round % 4 == 1);
    for (int i = 0; i < 3; ++i) bytes[random.next() % bytes.size()] = static_cast<char>(random.next());
    const absl::StatusOr<std::optional<std::string>> unpacked = unpack_ply_strips(bytes);
    if (unpacked.ok() && unpacked->has_value()) check_ply(**unpacked).status().IgnoreError();
  }
}

}  // namespace
}  // namespace locus::cli
