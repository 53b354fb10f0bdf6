#include "client/cli/security/private_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <iterator>

#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

mode_t mode_of_file(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0) << path;
  return status.st_mode & 07777;
}

TEST(PrivateFileTest, ANewFileHasItsModeAndIsNeverOverwritten) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("key");
  ASSERT_TRUE(create_security_file(path, {"first", kPrivateMode}).ok());
  EXPECT_EQ(mode_of_file(path), 0600u);
  EXPECT_TRUE(absl::IsAlreadyExists(create_security_file(path, {"second", kPrivateMode})));
  EXPECT_EQ(read_security_file(path)->text, "first");
  ASSERT_TRUE(create_security_file(folder.file("certificate"), {"", kPublicMode}).ok());
  EXPECT_EQ(mode_of_file(folder.file("certificate")), 0644u);
}

TEST(PrivateFileTest, AReplacedFileHasTheGivenModeAndLeavesNoOtherFile) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("tokens");
  ASSERT_TRUE(replace_security_file(path, {"one", kPrivateMode}).ok());
  ASSERT_TRUE(replace_security_file(path, {"two", 0640}).ok());
  const absl::StatusOr<SecurityFile> read = read_security_file(path);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->text, "two");
  EXPECT_EQ(read->mode, 0640u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(PrivateFileTest, AReplacedFileKeepsItsOwnerAndGroup) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a file to another user";
  const test::TemporaryFolder folder;
  const std::string path = folder.file("tokens");
  ASSERT_TRUE(replace_security_file(path, {"one", kPrivateMode}).ok());
  ASSERT_EQ(::chown(path.c_str(), 65534, 65533), 0);
  ASSERT_TRUE(replace_security_file(path, {"two", kPrivateMode}).ok());
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_uid, 65534u);
  EXPECT_EQ(status.st_gid, 65533u);
  EXPECT_EQ(status.st_mode & 07777, kPrivateMode);
}

TEST(PrivateFileTest, AMissingFileIsNotFoundAndALargeOneIsRefused) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(absl::IsNotFound(read_security_file(folder.file("no")).status()));
  EXPECT_TRUE(absl::IsNotFound(create_security_file(folder.file("no/file"), {"", kPrivateMode})));
  ASSERT_TRUE(create_security_file(folder.file("full"), {std::string(kMaxSecurityFileBytes, 'x'), 0600}).ok());
  EXPECT_TRUE(read_security_file(folder.file("full")).ok());
  ASSERT_TRUE(create_security_file(folder.file("large"), {std::string(kMaxSecurityFileBytes + 1, 'x'), 0600}).ok());
  EXPECT_EQ(read_security_file(folder.file("large")).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST(PrivateFileTest, TheLockIsHeldUntilItIsDestroyed) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("tokens");
  absl::StatusOr<FileLock> lock = FileLock::acquire(path);
  ASSERT_TRUE(lock.ok());
  const int other = ::open((path + ".lock").c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_GE(other, 0);
  EXPECT_NE(::flock(other, LOCK_EX | LOCK_NB), 0);
  { const FileLock ended = *std::move(lock); }
  EXPECT_EQ(::flock(other, LOCK_EX | LOCK_NB), 0);
  ::close(other);
}

}  // namespace
}  // namespace locus::cli
