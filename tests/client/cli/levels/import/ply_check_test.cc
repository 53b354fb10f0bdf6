#include "client/cli/levels/import/ply_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "client/cli/levels/generate/splitmix64.h"
#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

const std::string kTwoTriangles =
    "ply\nformat ascii 1.0\ncomment two\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

std::string binary_header(const std::string& format, const std::string& count_type) {
  return "ply\nformat " + format + " 1.0\nelement vertex 1\nproperty double x\nproperty short y\n" +
         "element face 1\nproperty list " + count_type + " ushort vertex_indices\nend_header\n";
}

std::string message(const std::string& bytes) { return std::string(check_ply(bytes).status().message()); }

TEST(PlyCheckTest, CountsTheDeclaredFaces) { EXPECT_EQ(check_ply(kTwoTriangles).value(), 2u); }

TEST(PlyCheckTest, WindowsLineEndsAreFine) {
  std::string bytes;
  for (char c : kTwoTriangles) bytes += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(check_ply(bytes).value(), 2u);
}

TEST(PlyCheckTest, AnAsciiBodyThatEndsEarlyNamesTheElement) {
  const std::string cut = kTwoTriangles.substr(0, kTwoTriangles.rfind("3 0 2 3"));
  EXPECT_THAT(message(cut), HasSubstr("face[1] of 2"));
}

TEST(PlyCheckTest, ABinaryBodyIsCheckedInBothByteOrders) {
  const std::string vertex(10, '\1');
  const std::string face(6, '\0');
  const std::string little = binary_header("binary_little_endian", "ushort") + vertex + std::string("\3\0", 2) + face;
  const std::string big = binary_header("binary_big_endian", "ushort") + vertex + std::string("\0\3", 2) + face;
  for (const std::string& whole : {little, big}) {
    EXPECT_EQ(check_ply(whole).value(), 1u);
    EXPECT_EQ(check_ply(whole + "more").value(), 1u);
    for (size_t missing = 1; missing <= 8; ++missing) {
      EXPECT_THAT(message(whole.substr(0, whole.size() - missing)), HasSubstr("face[0] of 1")) << missing;
    }
    for (size_t missing = 9; missing <= 18; ++missing) {
      EXPECT_THAT(message(whole.substr(0, whole.size() - missing)), HasSubstr("vertex[0] of 1")) << missing;
    }
  }
}

TEST(PlyCheckTest, ANegativeListLengthIsRefused) {
  const std::string body = std::string(10, '\0') + "\xFF" + std::string(600, '\0');
  EXPECT_THAT(message(binary_header("binary_little_endian", "char") + body), HasSubstr("face[0]"));
  EXPECT_EQ(check_ply(binary_header("binary_little_endian", "uchar") + body).value(), 1u);
}

TEST(PlyCheckTest, HugeDeclaredCountsStopAtTheEndOfTheBody) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement face 18446744073709551615\n"
      "property list uint double vertex_indices\nend_header\n";
  EXPECT_THAT(message(header + std::string(8, '\xFF')), HasSubstr("face[0]"));
}

TEST(PlyCheckTest, TriangleStripsBesideFacesAreRefusedWithARemedy) {
  std::string strips = kTwoTriangles;
  strips.insert(strips.find("end_header"), "element tristrips 1\nproperty list int int vertex_indices\n");
  strips += "3 0 1 2\n";
  EXPECT_THAT(message(strips), HasSubstr("save it with faces"));
}

TEST(PlyCheckTest, DamagedHeadersAreRefused) {
  EXPECT_THAT(message("plyx\nend_header\n"), HasSubstr("first line"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\n"), HasSubstr("end_header"));
  EXPECT_THAT(message("ply\nformat utf 1.0\nend_header\n"), HasSubstr("unknown format"));
  EXPECT_THAT(message("ply\nelement face\nend_header\n"), HasSubstr("count"));
  EXPECT_THAT(message("ply\nelement face -1\nend_header\n"), HasSubstr("count"));
  EXPECT_THAT(message("ply\nproperty float x\nend_header\n"), HasSubstr("before the first element"));
  EXPECT_THAT(message("ply\nelement face 1\nproperty list float int a\nend_header\n"), HasSubstr("unknown form"));
  EXPECT_THAT(message("ply\nelement face 1\nproperty quad a\nend_header\n"), HasSubstr("unknown form"));
}

TEST(PlyCheckTest, MessagesContainNoControlCharactersOfTheFile) {
  for (const std::string& line : {std::string("format \x1B[2J"), std::string("element \x1B[2J 9\nproperty char x"),
                                  "element a 1\nproperty \x1B[2J" + std::string(9000, 'x')}) {
    const absl::Status status = check_ply("ply\n" + line + "\nend_header\n").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << line;
    EXPECT_EQ(status.message().find('\x1B'), absl::string_view::npos) << status;
    EXPECT_LT(status.message().size(), 300u);
  }
}

TEST(PlyCheckTest, RandomMutationsNeverCrash) {
  constexpr uint64_t kSeed = 11;
  SplitMix64 random(kSeed);
  const std::string binary = binary_header("binary_little_endian", "int") + std::string(10, '\0') +
                             std::string("\3\0\0\0", 4) + std::string(6, '\0');
  int refused = 0;
  for (int round = 0; round < 4000; ++round) {
    std::string bytes = round % 2 == 0 ? kTwoTriangles : binary;
    for (uint32_t i = 0; i <= random.below(4); ++i) {
      bytes[random.below(static_cast<uint32_t>(bytes.size()))] = static_cast<char>(random.next());
    }
    bytes.resize(bytes.size() - random.below(3));
    refused += check_ply(bytes).ok() ? 0 : 1;
  }
  EXPECT_GT(refused, 500) << "seed " << kSeed;
}

}  // namespace
}  // namespace locus::cli
