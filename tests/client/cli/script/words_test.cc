#include "client/cli/script/words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/failure.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(WordsTest, BlanksSeparateWordsOutsideOfQuotes) {
  EXPECT_THAT(*split_words("  query\tray arena  "), ElementsAre("query", "ray", "arena"));
  EXPECT_THAT(*split_words("a 'b c' \"d e\" f'g h'i"), ElementsAre("a", "b c", "d e", "fg hi"));
  EXPECT_THAT(*split_words("'' \"\""), ElementsAre("", ""));
  EXPECT_THAT(*split_words(""), IsEmpty());
}

TEST(WordsTest, ABackslashMakesTheNextCharacterLiteralExceptInSingleQuotes) {
  EXPECT_THAT(*split_words(R"(a\ b \'c "d\"e" 'f\g')"), ElementsAre("a b", "'c", "d\"e", "f\\g"));
}

TEST(WordsTest, AHashAtTheBeginningOfAWordBeginsAComment) {
  EXPECT_THAT(*split_words("scene list # all of them"), ElementsAre("scene", "list"));
  EXPECT_THAT(*split_words("a#b '#c'"), ElementsAre("a#b", "#c"));
  EXPECT_THAT(*split_words("# only a comment 'unclosed"), IsEmpty());
}

TEST(WordsTest, OpenQuotesAndLoneBackslashesAreUsageErrors) {
  for (const char* line : {"a 'b", "a \"b", "a \\"}) {
    const absl::Status status = split_words(line).status();
    EXPECT_EQ(exit_code_of(status), ExitCode::kUsage) << line;
  }
  EXPECT_THAT(split_words("a 'b").status().message(), HasSubstr("a ' is not closed"));
}

}  // namespace
}  // namespace locus::cli
