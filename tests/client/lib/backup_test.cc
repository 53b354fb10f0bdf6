#include "client/lib/backup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::client {
namespace {

using ::testing::HasSubstr;

std::string refusal_of(const std::string& path) {
  BackupPaths paths;
  return std::string(paths.add(path).message());
}

TEST(BackupPathsTest, OrdinaryPathsAreAccepted) {
  BackupPaths paths;
  for (const char* path :
       {"CURRENT", "000007.sst", "tables/1", "tables/deep/1", "...", ".hidden", "a b", "grün/ü", "a..b", "tables 2/1"})
    EXPECT_TRUE(paths.add(path).ok()) << path;
  EXPECT_TRUE(paths.add(std::string(kMaxBackupPathLength, 'a')).ok());
}

TEST(BackupPathsTest, PathsThatLeadOutOfTheDirectoryAreRefused) {
  for (const char* path : {"/etc/passwd", "..", "../x", "a/../b", "a/..", ".", "./a", "a/.", "a//b", "a/", "/"})
    EXPECT_THAT(refusal_of(path), HasSubstr("leads out of its directory")) << path;
  EXPECT_EQ(refusal_of(""), "is empty");
}

TEST(BackupPathsTest, PathsWithControlCharactersOrBackslashesAreRefused) {
  for (const std::string& path :
       {std::string("a\nb"), std::string("a\0b", 3), std::string("a\\b"), std::string("a\x7F"), std::string("\x1B[2J")})
    EXPECT_THAT(refusal_of(path), HasSubstr("has a character that a path may not have")) << path;
}

TEST(BackupPathsTest, ALongPathIsRefused) {
  EXPECT_EQ(refusal_of(std::string(kMaxBackupPathLength + 1, 'a')), "is too long");
}

TEST(BackupPathsTest, DuplicatePathsAndFilesUsedAsFoldersAreRefused) {
  BackupPaths paths;
  ASSERT_TRUE(paths.add("tables/deep/1").ok());
  EXPECT_EQ(paths.add("tables/deep/1").message(), "comes twice");
  EXPECT_EQ(paths.add("tables").message(), "is a folder of another file");
  EXPECT_EQ(paths.add("tables/deep").message(), "is a folder of another file");
  EXPECT_EQ(paths.add("tables/deep/1/2").message(), "is below a path that is a file");
}

TEST(BackupPathsTest, TheNumberOfFilesIsLimited) {
  BackupPaths paths;
  for (size_t i = 0; i < kMaxBackupFiles; ++i) ASSERT_TRUE(paths.add(std::to_string(i)).ok());
  EXPECT_EQ(paths.add("one more").message(), "is one more than a backup may have");
}

}  // namespace
}  // namespace locus::client
