#include "client/cli/backup/file_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

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
