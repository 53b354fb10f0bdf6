#include "client/cli/security/context_writer.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

TEST(ContextWriterTest, WhatIsWrittenIsReadAgainWithMode0600) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("config/locus/contexts");
  client::SavedContexts contexts;
  contexts.default_name = "prod";
  contexts.by_name["prod"] = {"host:1", "true", "/ca.pem", "/c.pem", "/c.key", "inner", "/token"};
  ASSERT_TRUE(write_contexts(path, contexts).ok());
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0600u);
  const absl::StatusOr<client::SavedContexts> read = client::read_contexts(path);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(contexts_text(*read), contexts_text(contexts));
}

TEST(ContextWriterTest, WithoutAFolderForContextsNothingIsWritten) {
  EXPECT_EQ(write_contexts("", {}).code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace locus::cli
