#include "client/cli/backup/checksums.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

const char kHex[] = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

Checksum checksum_of(const std::string& path, const std::string& bytes) {
  client::Sha256Hasher hasher;
  hasher.add(bytes);
  return {path, hasher.finish()};
}

std::string refusal_of(const std::string& text) {
  const absl::Status status = parse_checksums(text).status();
  EXPECT_TRUE(absl::IsDataLoss(status)) << text << ": " << status;
  return std::string(status.message());
}

TEST(ChecksumsTest, ALineHasTheFormatOfCoreutils) {
  EXPECT_EQ(checksum_text({checksum_of("tables/a b", "abc")}), std::string(kHex) + "  tables/a b\n");
}

TEST(ChecksumsTest, WrittenChecksumsParseToTheSame) {
  const std::vector<Checksum> checksums = {checksum_of("CURRENT", "abc"), checksum_of("tables/1", "")};
  const absl::StatusOr<std::vector<Checksum>> again = parse_checksums(checksum_text(checksums));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(*again, checksums);
}

TEST(ChecksumsTest, NoFilesAreNoLines) {
  const absl::StatusOr<std::vector<Checksum>> none = parse_checksums("");
  ASSERT_TRUE(none.ok());
  EXPECT_THAT(*none, SizeIs(0));
}

TEST(ChecksumsTest, AMalformedLineIsReportedWithItsNumber) {
  const std::string good = std::string(kHex) + "  a\n";
  const std::string hex = kHex;
  for (const std::string& bad :
       {std::string("\n"), hex + "\n", hex + " b\n", hex + " *b\n", "B" + hex.substr(1) + "  b\n",
        hex.substr(1) + "   b\n", "g" + hex.substr(1) + "  b\n"})
    EXPECT_THAT(refusal_of(good + bad), HasSubstr("line 2 of SHA256SUMS is damaged: it is not 64 hex")) << bad;
  EXPECT_THAT(refusal_of(good + hex + "  b"), HasSubstr("line 2 of SHA256SUMS is damaged: it does not end"));
}

TEST(ChecksumsTest, RepeatedPathsAndPathsOutsideTheBackupAreDataLoss) {
  const std::string hex = kHex;
  EXPECT_THAT(refusal_of(hex + "  ../x\n"), HasSubstr("leads out of its directory"));
  EXPECT_THAT(refusal_of(hex + "  /x\n"), HasSubstr("leads out of its directory"));
  EXPECT_THAT(refusal_of(hex + "  \n"), HasSubstr("is empty"));
  EXPECT_THAT(refusal_of(hex + "  x\n" + hex + "  x\n"), HasSubstr("comes twice"));
}

TEST(ChecksumsTest, ALongPathIsShortenedInTheMessage) {
  const std::string message = refusal_of(kHex + ("  ../" + std::string(100'000, '\x01')) + "\n");
  EXPECT_LT(message.size(), 1200u);
}

}  // namespace
}  // namespace locus::cli
