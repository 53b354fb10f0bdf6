#include "client/cli/levels/import/quake/pk3_archive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zip.h>

#include <map>
#include <string>

#include "client/cli/levels/generate/splitmix64.h"
#include "client/cli/levels/import/import_file.h"
#include "client/cli/levels/import/import_limits.h"
#include "tests/client/cli/levels/import/quake/bsp_writer.h"

namespace locus::cli {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

using Entries = std::map<std::string, std::string>;

std::string write_archive(const TempFolder& folder, const Entries& entries) {
  const std::string path = folder.path("pak.pk3");
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
  EXPECT_NE(archive, nullptr);
  for (const auto& [name, bytes] : entries) {
    zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
    const zip_int64_t number = zip_file_add(archive, name.c_str(), source, 0);
    EXPECT_GE(number, 0) << name;
    // Uses the fastest compression level, since one test compresses more bytes than the import limit.
    EXPECT_EQ(zip_set_file_compression(archive, static_cast<zip_uint64_t>(number), ZIP_CM_DEFLATE, 1), 0) << name;
  }
  EXPECT_EQ(zip_close(archive), 0);
  return path;
}

std::string archive_of(const TempFolder& folder, const Entries& entries) {
  std::ifstream file(write_archive(folder, entries), std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

Entries three_levels() {
  BspWriter small = small_level();
  small.faces.resize(1);
  return {{"maps/beta.bsp", small_level().bytes()},
          {"maps/Alpha.BSP", small.bytes()},
          {"maps/gamma.bsp", "IBSP no more"},
          {"textures/floor.tga", "picture"}};
}

TEST(Pk3ArchiveTest, WithoutAnEntryTheFirstLevelIsTakenAndTheOthersAreNoted) {
  const TempFolder folder;
  const std::string path = write_archive(folder, three_levels());
  const auto level = import_file(path, {});
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->meshes.at(0).name, "Alpha");
  EXPECT_EQ(level->meshes.at(0).indices.size(), 6u);
  EXPECT_THAT(level->notes, Contains("The archive holds other levels: maps/beta.bsp, maps/gamma.bsp."));
}

TEST(Pk3ArchiveTest, AnEntryIsFoundByPathOrNameInAnyCase) {
  const TempFolder folder;
  const std::string path = write_archive(folder, three_levels());
  for (const char* entry : {"maps/beta.bsp", "MAPS/BETA.BSP", "beta.bsp", "Beta"}) {
    const auto level = import_file(path, {.entry = entry});
    ASSERT_TRUE(level.ok()) << entry << ": " << level.status();
    EXPECT_EQ(level->meshes.at(0).name, "beta");
    EXPECT_EQ(level->meshes.at(0).indices.size() / 3, 75u);
  }
}

TEST(Pk3ArchiveTest, ADamagedLevelIsRefusedByItsEntry) {
  const TempFolder folder;
  const auto level = import_file(write_archive(folder, three_levels()), {.entry = "gamma"});
  EXPECT_EQ(level.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(level.status().message()), HasSubstr("maps/gamma.bsp: not a Quake 3 level"));
}

TEST(Pk3ArchiveTest, AnUnknownEntryIsNotFoundAndTheLevelsAreListed) {
  const TempFolder folder;
  const auto level = import_file(write_archive(folder, three_levels()), {.entry = "delta"});
  EXPECT_EQ(level.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(level.status().message()),
              HasSubstr("choose one of maps/Alpha.BSP, maps/beta.bsp, maps/gamma"));
}

TEST(Pk3ArchiveTest, AnArchiveWithoutLevelsIsNotFound) {
  const TempFolder folder;
  const auto level = import_file(write_archive(folder, {{"readme.txt", "hello"}}), {});
  EXPECT_EQ(level.status().code(), absl::StatusCode::kNotFound);
}

TEST(Pk3ArchiveTest, ReadingGivesTheWholeBytes) {
  const TempFolder folder;
  std::string big(300'000, '\0');
  SplitMix64 random(1);
  for (char& c : big) c = static_cast<char>(random.next());
  const auto level = read_pk3_level(archive_of(folder, {{"maps/a.bsp", big}}), "a.pk3", "");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->bytes, big);
  EXPECT_EQ(level->entry, "maps/a.bsp");
  EXPECT_THAT(level->others, ElementsAre());
}

void write_random_word(std::string& bytes, size_t at, SplitMix64& random) {
  const uint64_t word = random.next();
  for (size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<char>(word >> (8 * i));
}

std::string message_of(const absl::StatusOr<Pk3Level>& level) { return std::string(level.status().message()); }

TEST(Pk3ArchiveTest, ALevelThatUnpacksBeyondTheLimitIsRefused) {
  const TempFolder folder;
  std::string big(kMaxBspBytes + 1, '\0');
  SplitMix64 random(1);
  for (size_t i = 0; i + 4 < big.size(); i += 256) write_random_word(big, i, random);
  const auto level = read_pk3_level(archive_of(folder, {{"a.bsp", big}}), "a.pk3", "");
  EXPECT_EQ(level.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(level),
            "a.bsp in a.pk3 has more bytes unpacked, the limit level_bytes is 268435456: give another level");
}

TEST(Pk3ArchiveTest, ALevelThatExpandsBeyondTheRatioIsRefusedEarly) {
  const TempFolder folder;
  const std::string archive = archive_of(folder, {{"a.bsp", std::string(8 << 20, '\0')}});
  EXPECT_LT(archive.size(), 50'000u);
  const auto level = read_pk3_level(archive, "a.pk3", "");
  EXPECT_EQ(level.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(message_of(level), HasSubstr("the limit archive_ratio is 200: pack the level again"));
}

TEST(Pk3ArchiveTest, ASmallLevelMayExpandByAnyRatio) {
  const TempFolder folder;
  const std::string zeros(kMinCheckedBytes, '\0');
  const auto level = read_pk3_level(archive_of(folder, {{"a.bsp", zeros}}), "a.pk3", "");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->bytes, zeros);
}

TEST(Pk3ArchiveTest, TooManyEntriesAreRefused) {
  const TempFolder folder;
  Entries entries;
  for (int64_t i = 0; i <= kMaxArchiveEntries; ++i) entries["e" + std::to_string(i)] = "";
  const auto level = read_pk3_level(archive_of(folder, entries), "a.pk3", "");
  EXPECT_EQ(level.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(level),
            "a.pk3 has 65537 entries, the limit archive_entries is 65536: give an archive with fewer files");
}

TEST(Pk3ArchiveTest, ALongEntryNameIsRefused) {
  const TempFolder folder;
  const Entries entries = {{std::string(kMaxEntryNameBytes + 1, 'x'), ""}};
  const auto level = read_pk3_level(archive_of(folder, entries), "a.pk3", "");
  EXPECT_EQ(level.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(message_of(level), HasSubstr("the limit entry_name_bytes is 1024"));
}

TEST(Pk3ArchiveTest, ListedEntriesHaveNoControlCharacters) {
  const TempFolder folder;
  const auto level = import_file(write_archive(folder, {{"maps/\x1B[2J.bsp", "a"}}), {.entry = "none"});
  EXPECT_EQ(level.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(level.status().message()), Not(HasSubstr("\x1B")));
}

TEST(Pk3ArchiveTest, RandomMutationsAreRefusedOrGiveAValidMesh) {
  constexpr uint64_t kSeed = 9;
  SplitMix64 random(kSeed);
  const TempFolder folder;
  const std::string path = write_archive(folder, three_levels());
  std::ifstream file(path, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  int refused = 0;
  for (int round = 0; round < 500; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << " round " << round);
    std::string bytes = whole;
    for (int i = 0; i < 3; ++i) {
      bytes[random.below(static_cast<uint32_t>(bytes.size()))] = static_cast<char>(random.next());
    }
    const auto level = import_file(folder.write("mutated.pk3", bytes), {.entry = "beta"});
    if (level.ok()) {
      ASSERT_NO_FATAL_FAILURE(expect_sound(*level));
    } else {
      ++refused;
      ASSERT_THAT(std::string(level.status().message()), Not(HasSubstr("the importer"))) << "the reader crashed";
    }
  }
  EXPECT_GT(refused, 50) << "seed " << kSeed;
}

}  // namespace
}  // namespace locus::cli
