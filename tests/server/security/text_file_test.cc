#include "server/security/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>

#include "server/security/security_limits.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

class TextFileTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  const std::string file_ = folder_.file("text");
};

TEST_F(TextFileTest, WhatIsReplacedIsReadBackWithItsMode) {
  for (const mode_t mode : {0600, 0640, 0644}) {
    ASSERT_TRUE(replace_text_file(file_, std::string("a\0b\n", 4), mode).ok());
    EXPECT_EQ(read_text_file(file_)->text, std::string("a\0b\n", 4));
    EXPECT_EQ(read_text_file(file_)->mode, mode);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1) << "a temporary file is left";
}

TEST_F(TextFileTest, OnlyRegularFilesUpToTheLimitAreRead) {
  EXPECT_EQ(read_text_file(file_).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(read_text_file(folder_.path()).status().code(), absl::StatusCode::kInvalidArgument);
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  // A pipe is refused without waiting for its other end.
  EXPECT_EQ(read_text_file(file_).status().code(), absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(replace_text_file(file_, std::string(kMaxSecurityFileBytes, 'a'), 0600).ok());
  EXPECT_EQ(read_text_file(file_)->text.size(), kMaxSecurityFileBytes);
  ASSERT_TRUE(replace_text_file(file_, std::string(kMaxSecurityFileBytes + 1, 'a'), 0600).ok());
  EXPECT_EQ(read_text_file(file_).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(TextFileTest, AFileThatOthersCanWriteIsRefused) {
  for (const mode_t mode : {0620, 0602}) {
    ASSERT_TRUE(replace_text_file(file_, "a", mode).ok());
    EXPECT_THAT(std::string(read_text_file(file_).status().message()), testing::HasSubstr("chmod go-w"));
  }
}

TEST_F(TextFileTest, AFolderThatDoesNotExistGetsNoFile) {
  EXPECT_EQ(replace_text_file(folder_.file("none/text"), "a", 0600).code(), absl::StatusCode::kNotFound);
}

TEST_F(TextFileTest, WordsInErrorsAreQuotedEscapedAndShort) {
  EXPECT_EQ(quoted_word("arena"), "`arena`");
  EXPECT_EQ(quoted_word("\x1b["), "`\\x1b[`");
  EXPECT_LT(quoted_word(std::string(1000, 'a')).size(), 80u);
  EXPECT_EQ(refuse_line("f", 3, "why").message(), "f:3: why");
}

}  // namespace
}  // namespace locus::server
