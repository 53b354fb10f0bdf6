#include "client/lib/saved_contexts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::client {
namespace {

using ::testing::HasSubstr;

TEST(SavedContextsTest, TheTextOfContextsIsParsedAgain) {
  SavedContexts contexts;
  contexts.default_name = "prod";
  contexts.by_name["prod"] = {"host:1", "true", "/ca.pem", "/c.pem", "/c.key", "inner", "/token", "arena"};
  contexts.by_name["bare"] = {};
  const absl::StatusOr<SavedContexts> read = parse_contexts("f", contexts_text(contexts));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->default_name, "prod");
  ASSERT_EQ(read->by_name.size(), 2u);
  EXPECT_EQ(fields_of(read->by_name.at("prod")), fields_of(contexts.by_name["prod"]));
  EXPECT_EQ(fields_of(read->by_name.at("bare")), fields_of({}));
}

TEST(SavedContextsTest, AFileThatDoesNotExistHasNoContexts) {
  EXPECT_TRUE(read_contexts("/nonexistent/contexts")->by_name.empty());
  EXPECT_TRUE(read_contexts("")->by_name.empty());
}

TEST(SavedContextsTest, CommentsAndBlankLinesAreIgnored) {
  const auto contexts = parse_contexts("f", "# mine\n\ndefault=a\n[a]\n  address =  host:1 \n");
  ASSERT_TRUE(contexts.ok()) << contexts.status();
  EXPECT_EQ(contexts->default_name, "a");
  EXPECT_EQ(contexts->by_name.at("a").address, "host:1");
}

TEST(SavedContextsTest, AMistakeIsReportedWithItsLine) {
  for (const char* text : {"\naddress = x", "\n[a b]", "[a]\ntoken = secret", "[a]\ntls = yes", "[a]\nnonsense"}) {
    const absl::Status status = parse_contexts("file", text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("file:2: ")) << text;
  }
}

TEST(SavedContextsTest, AnUnknownNameIsReportedWithTheKnownOnes) {
  SavedContexts contexts;
  contexts.by_name["prod"] = {};
  EXPECT_TRUE(find_context(contexts, "prod").ok());
  const absl::Status status = find_context(contexts, "test").status();
  EXPECT_TRUE(absl::IsNotFound(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("there is prod"));
}

}  // namespace
}  // namespace locus::client
