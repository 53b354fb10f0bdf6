#include "server/security/rotated_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

class RotatedFileTest : public testing::Test {
 protected:
  std::string text(const std::string& ending = "") {
    std::ostringstream content;
    content << std::ifstream(file_ + ending).rdbuf();
    return content.str();
  }
  bool exists(const std::string& ending) { return std::filesystem::exists(file_ + ending); }

  test::TemporaryFolder folder_;
  const std::string file_ = folder_.file("log");
};

TEST_F(RotatedFileTest, LinesAreAppendedToAPrivateFile) {
  std::ofstream(file_) << "old\n";
  std::filesystem::permissions(file_, std::filesystem::perms(0644));
  auto file = *RotatedFile::open(file_, 100, 3);
  ASSERT_TRUE(file->append("new\n").ok());
  EXPECT_EQ(text(), "old\nnew\n");
  EXPECT_EQ(std::filesystem::status(file_).permissions(), std::filesystem::perms(0600));
}

TEST_F(RotatedFileTest, AFullFileIsRenamedAndTheOldestRemoved) {
  auto file = *RotatedFile::open(file_, 10, 3);
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(file->append(absl::StrCat("n", i, "..\n")).ok());
  EXPECT_EQ(text(), "n6..\nn7..\n");
  EXPECT_EQ(text(".1"), "n4..\nn5..\n");
  EXPECT_EQ(text(".2"), "n2..\nn3..\n");
  EXPECT_FALSE(exists(".3"));
}

TEST_F(RotatedFileTest, ALineLargerThanTheMaximumIsWrittenWhole) {
  auto file = *RotatedFile::open(file_, 10, 3);
  ASSERT_TRUE(file->append(std::string(50, 'a') + "\n").ok());
  ASSERT_TRUE(file->append("b\n").ok());
  EXPECT_EQ(text(".1"), std::string(50, 'a') + "\n");
  EXPECT_EQ(text(), "b\n");
}

TEST_F(RotatedFileTest, ReopenCreatesAMovedFileAgain) {
  auto file = *RotatedFile::open(file_, 100, 3);
  ASSERT_TRUE(file->append("a\n").ok());
  std::filesystem::rename(file_, file_ + ".moved");
  ASSERT_TRUE(file->append("b\n").ok());
  ASSERT_TRUE(file->reopen().ok());
  ASSERT_TRUE(file->append("c\n").ok());
  EXPECT_EQ(text(".moved"), "a\nb\n");
  EXPECT_EQ(text(), "c\n");
}

TEST_F(RotatedFileTest, IfReopeningFailsTheOldFileIsUsedFurther) {
  const std::string folder = folder_.file("folder");
  std::filesystem::create_directory(folder);
  auto file = *RotatedFile::open(folder + "/log", 100, 3);
  std::filesystem::rename(folder, folder_.file("moved"));
  EXPECT_FALSE(file->reopen().ok());
  EXPECT_TRUE(file->append("a\n").ok());
  EXPECT_EQ(std::filesystem::file_size(folder_.file("moved/log")), 2u);
}

TEST_F(RotatedFileTest, WhatIsNoRegularFileIsRefused) {
  EXPECT_FALSE(RotatedFile::open(folder_.path(), 100, 3).ok());
  EXPECT_FALSE(RotatedFile::open(folder_.file("none/log"), 100, 3).ok());
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  EXPECT_FALSE(RotatedFile::open(file_, 100, 3).ok());
}

// A file size limit of the process simulates a full disk: the kernel writes the bytes that fit, then refuses.
TEST_F(RotatedFileTest, AFullDiskIsAnErrorAndLeavesNoHalfLine) {
  auto file = *RotatedFile::open(file_, 1u << 20, 3);
  ASSERT_TRUE(file->append("a\n").ok());
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small = {10, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const absl::Status status = file->append(std::string(50, 'b') + "\n");
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(status.ok());
  ASSERT_TRUE(file->append("c\n").ok());
  EXPECT_EQ(text(), "a\nc\n");
}

}  // namespace
}  // namespace locus::server
