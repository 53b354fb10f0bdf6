#include "client/cli/backup/partial_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

bool exists(const std::string& path) { return std::filesystem::exists(path); }

absl::Status write_file(PartialDirectory& directory, const std::string& path, const std::string& bytes) {
  if (absl::Status opened = directory.open_file(path); !opened.ok()) return opened;
  if (absl::Status written = directory.write(bytes); !written.ok()) return written;
  return directory.close_file();
}

class PartialDirectoryTest : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  const std::string target_ = folder_.file("target");
};

TEST_F(PartialDirectoryTest, TheTargetAppearsCompleteOnKeep) {
  PartialDirectory directory(target_, TargetRule::kNothing);
  ASSERT_TRUE(directory.make(3).ok());
  ASSERT_TRUE(write_file(directory, "a/b/one", "1").ok());
  ASSERT_TRUE(write_file(directory, "a/two", "22").ok());
  ASSERT_TRUE(write_file(directory, "empty", "").ok());
  EXPECT_FALSE(exists(target_));
  ASSERT_TRUE(directory.keep().ok());
  EXPECT_EQ(text_of(target_ + "/a/b/one"), "1");
  EXPECT_EQ(text_of(target_ + "/a/two"), "22");
  EXPECT_TRUE(exists(target_ + "/empty"));
  EXPECT_FALSE(exists(directory.partial()));
}

TEST_F(PartialDirectoryTest, TheDestructorRemovesADirectoryThatWasNotKept) {
  {
    PartialDirectory directory(target_, TargetRule::kNothing);
    ASSERT_TRUE(directory.make(0).ok());
    ASSERT_TRUE(write_file(directory, "a/one", "1").ok());
    ASSERT_TRUE(directory.open_file("half").ok());
    ASSERT_TRUE(directory.write("1").ok());
    EXPECT_TRUE(exists(directory.partial()));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(PartialDirectoryTest, OnlyTheOwnerHasAccess) {
  PartialDirectory directory(target_, TargetRule::kNothing);
  ASSERT_TRUE(directory.make(0).ok());
  ASSERT_TRUE(write_file(directory, "a/one", "1").ok());
  ASSERT_TRUE(directory.keep().ok());
  for (const char* path : {"", "/a", "/a/one"}) {
    struct stat status = {};
    ASSERT_EQ(stat((target_ + path).c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0077, 0u) << path;
  }
}

TEST_F(PartialDirectoryTest, AnExistingTargetIsRefusedUnlessTheRuleAllowsEmpty) {
  std::filesystem::create_directory(target_);
  const PartialDirectory strict(target_, TargetRule::kNothing);
  EXPECT_THAT(std::string(strict.check().message()), HasSubstr("exists already"));
  const PartialDirectory lenient(target_, TargetRule::kNothingOrEmpty);
  EXPECT_TRUE(lenient.check().ok());
  std::ofstream(target_ + "/CURRENT") << "precious";
  EXPECT_THAT(std::string(lenient.check().message()), HasSubstr("nothing is overwritten"));
  PartialDirectory made(target_, TargetRule::kNothingOrEmpty);
  EXPECT_FALSE(made.make(0).ok());
  EXPECT_FALSE(exists(made.partial()));
}

TEST_F(PartialDirectoryTest, AFileAtTheTargetIsRefused) {
  std::ofstream(target_) << "precious";
  const PartialDirectory directory(target_, TargetRule::kNothingOrEmpty);
  EXPECT_TRUE(absl::IsFailedPrecondition(directory.check()));
}

TEST_F(PartialDirectoryTest, ATargetFilledAfterMakeIsNotOverwritten) {
  PartialDirectory directory(target_, TargetRule::kNothing);
  ASSERT_TRUE(directory.make(0).ok());
  std::filesystem::create_directory(target_);
  std::ofstream(target_ + "/CURRENT") << "precious";
  EXPECT_FALSE(directory.keep().ok());
  EXPECT_EQ(text_of(target_ + "/CURRENT"), "precious");
}

TEST_F(PartialDirectoryTest, AnEmptyTargetIsReplaced) {
  std::filesystem::create_directory(target_);
  PartialDirectory directory(target_ + "/", TargetRule::kNothingOrEmpty);
  ASSERT_TRUE(directory.make(0).ok());
  ASSERT_TRUE(write_file(directory, "one", "1").ok());
  ASSERT_TRUE(directory.keep().ok());
  EXPECT_EQ(text_of(target_ + "/one"), "1");
}

TEST_F(PartialDirectoryTest, APartialDirectoryOfAnotherRunIsReportedAndKept) {
  std::filesystem::create_directory(target_ + ".partial");
  {
    PartialDirectory directory(target_, TargetRule::kNothing);
    const absl::Status made = directory.make(0);
    EXPECT_TRUE(absl::IsFailedPrecondition(made));
    EXPECT_THAT(std::string(made.message()), HasSubstr(target_ + ".partial is there"));
  }
  EXPECT_TRUE(exists(target_ + ".partial")) << "it may be another run's";
}

TEST_F(PartialDirectoryTest, MoreBytesThanTheDiskHasFreeAreRefusedAtOnce) {
  PartialDirectory directory(target_, TargetRule::kNothing);
  const absl::Status made = directory.make(std::numeric_limits<uint64_t>::max());
  EXPECT_TRUE(absl::IsResourceExhausted(made)) << made;
}

TEST_F(PartialDirectoryTest, AMissingParentFolderIsReported) {
  PartialDirectory directory(folder_.file("missing/target"), TargetRule::kNothing);
  const absl::Status made = directory.make(0);
  EXPECT_TRUE(absl::IsNotFound(made)) << made;
  EXPECT_THAT(std::string(made.message()), HasSubstr("missing/target.partial"));
}

TEST_F(PartialDirectoryTest, AFileIsNeverWrittenTwice) {
  PartialDirectory directory(target_, TargetRule::kNothing);
  ASSERT_TRUE(directory.make(0).ok());
  ASSERT_TRUE(write_file(directory, "one", "1").ok());
  EXPECT_FALSE(directory.open_file("one").ok());
}

TEST(FileErrorTest, TheCodeDependsOnErrno) {
  EXPECT_TRUE(absl::IsNotFound(file_error("read", "x", ENOENT)));
  EXPECT_TRUE(absl::IsResourceExhausted(file_error("write", "x", ENOSPC)));
  EXPECT_TRUE(absl::IsResourceExhausted(file_error("write", "x", EDQUOT)));
  EXPECT_TRUE(absl::IsFailedPrecondition(file_error("read", "x", EACCES))) << "only servers deny";
  EXPECT_TRUE(absl::IsFailedPrecondition(file_error("read", "x", EIO)));
}

TEST(FileErrorTest, TheMessageHasTheCauseAndAdvice) {
  EXPECT_EQ(file_error("write", "a/b", ENOSPC).message(),
            "cannot write a/b: No space left on device; free some of that disk, or choose another");
  EXPECT_THAT(std::string(file_error("make", "a", EBUSY).message()), HasSubstr("choose a new directory within it"));
}

}  // namespace
}  // namespace locus::cli
