#include "client/cli/levels/import/level_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "client/cli/levels/generate/splitmix64.h"
#include "client/cli/levels/import/import_limits.h"
#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

ImportedLevel small_imported_level() {
  ImportedLevel level;
  level.source_format = "OBJ";
  level.recentre = {1e6, -2, 0.1};
  level.notes = {"One note.", "Another."};
  level.meshes.push_back(
      {"yard", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, {0, 1, 2, 1, 3, 2}, {{"floor", 0}, {"wall", 1}}});
  return level;
}

std::string refusal_of_answer(const std::string& bytes) {
  const absl::StatusOr<ImportedLevel> level = decode_level(bytes);
  EXPECT_TRUE(level.ok() || absl::IsInvalidArgument(level.status())) << level.status();
  return level.ok() ? "accepted" : std::string(level.status().message());
}

TEST(LevelCodecTest, ALevelComesBackEqual) {
  const ImportedLevel level = small_imported_level();
  const absl::StatusOr<ImportedLevel> again = decode_level(encode_level(level));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->source_format, level.source_format);
  EXPECT_EQ(again->recentre, level.recentre);
  EXPECT_EQ(again->notes, level.notes);
  ASSERT_EQ(again->meshes.size(), 1u);
  EXPECT_EQ(again->meshes[0].name, "yard");
  EXPECT_EQ(again->meshes[0].vertices, level.meshes[0].vertices);
  EXPECT_EQ(again->meshes[0].indices, level.meshes[0].indices);
  EXPECT_EQ(again->meshes[0].parts[1].name, "wall");
  EXPECT_EQ(again->meshes[0].parts[1].first_triangle, 1u);
}

TEST(LevelCodecTest, AnErrorKeepsItsCodeAndLosesControlCharacters) {
  const absl::Status error = decode_level(encode_level(absl::NotFoundError("no \x1B[2J level"))).status();
  EXPECT_EQ(error, absl::NotFoundError("no _[2J level"));
}

TEST(LevelCodecTest, AnErrorThatNoImporterReturnsIsRefused) {
  EXPECT_THAT(refusal_of_answer(encode_level(absl::PermissionDeniedError("ask"))), HasSubstr("damaged answer"));
}

TEST(LevelCodecTest, LongTextsAreTruncatedAndManyNotesLeftOut) {
  ImportedLevel level = small_imported_level();
  level.notes.assign(kMaxImportNotes + 5, std::string(kMaxImportTextBytes + 5, 'x'));
  const absl::StatusOr<ImportedLevel> again = decode_level(encode_level(level));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->notes.size(), kMaxImportNotes);
  EXPECT_EQ(again->notes[0].size(), kMaxImportTextBytes);
}

TEST(LevelCodecTest, MeshesWithoutTheInvariantsAreRefused) {
  ImportedLevel level = small_imported_level();
  level.meshes[0].indices[4] = 4;
  EXPECT_THAT(refusal_of_answer(encode_level(level)), HasSubstr("damaged answer"));
  level = small_imported_level();
  level.meshes[0].vertices[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal_of_answer(encode_level(level)), HasSubstr("damaged answer"));
  level = small_imported_level();
  level.meshes[0].indices.pop_back();
  EXPECT_THAT(refusal_of_answer(encode_level(level)), HasSubstr("damaged answer"));
  level = small_imported_level();
  level.meshes[0].parts[1].first_triangle = 2;
  EXPECT_THAT(refusal_of_answer(encode_level(level)), HasSubstr("damaged answer"));
  level = small_imported_level();
  level.meshes[0].parts[1].first_triangle = 0;
  EXPECT_THAT(refusal_of_answer(encode_level(level)), HasSubstr("damaged answer"));
  level = small_imported_level();
  level.recentre[1] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal_of_answer(encode_level(level)), HasSubstr("damaged answer"));
  level = small_imported_level();
  level.meshes.clear();
  EXPECT_THAT(refusal_of_answer(encode_level(level)), HasSubstr("damaged answer"));
}

TEST(LevelCodecTest, EveryTruncationAndEveryAppendedByteIsRefused) {
  const std::string whole = encode_level(small_imported_level());
  for (size_t size = 0; size < whole.size(); ++size)
    ASSERT_THAT(refusal_of_answer(whole.substr(0, size)), HasSubstr("damaged answer")) << size;
  EXPECT_THAT(refusal_of_answer(whole + '\0'), HasSubstr("damaged answer"));
}

TEST(LevelCodecTest, RandomMutationsAreRefusedOrGiveAValidMesh) {
  constexpr uint64_t kSeed = 3;
  SplitMix64 random(kSeed);
  const std::string whole = encode_level(small_imported_level());
  for (int round = 0; round < 20'000; ++round) {
    std::string bytes = whole;
    for (int i = 0; i < 2; ++i)
      bytes[random.below(static_cast<uint32_t>(bytes.size()))] = static_cast<char>(random.next());
    const absl::StatusOr<ImportedLevel> level = decode_level(bytes);
    if (!level.ok()) continue;
    ASSERT_NO_FATAL_FAILURE(expect_sound(*level)) << "seed " << kSeed << " round " << round;
  }
}

}  // namespace
}  // namespace locus::cli
