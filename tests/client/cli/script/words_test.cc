#include "client/cli/script/words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/script/script_limits.h"
#include "client/cli/unknown_values.h"
#include "tests/client/cli/script/script_values.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> words(const std::string& line) {
  const absl::StatusOr<std::vector<Word>> read = read_words(line, testing::some_variables());
  if (!read.ok()) return {"error: " + std::string(read.status().message())};
  std::vector<std::string> texts;
  for (const Word& word : *read) texts.push_back(word.text);
  return texts;
}

TEST(WordsTest, BlanksSeparateWordsAndQuotesPreserveBlanks) {
  EXPECT_THAT(words("  query ray\tarena  "), ElementsAre("query", "ray", "arena"));
  EXPECT_THAT(words("a 'b c' \"d e\" f\\ g"), ElementsAre("a", "b c", "d e", "f g"));
  EXPECT_THAT(words("'' \"\""), ElementsAre("", ""));
  EXPECT_THAT(words("--label=a' 'b\"$n\"c"), ElementsAre("--label=a b3c"));
  EXPECT_THAT(words(""), IsEmpty());
}

TEST(WordsTest, ACommentBeginsOnlyAtTheBeginningOfAWord) {
  EXPECT_THAT(words("a # b c"), ElementsAre("a"));
  EXPECT_THAT(words("# all"), IsEmpty());
  EXPECT_THAT(words("a#b '#c'"), ElementsAre("a#b", "#c"));
}

TEST(WordsTest, SubstitutedValuesNeverSplitAWord) {
  EXPECT_THAT(words("--from $p --id $near.id[1]"), ElementsAre("--from", "1,2,3", "--id", "9223372036854775809"));
  EXPECT_THAT(words("--at {$n * 2},0,1 {$p + 0,0,1}"), ElementsAre("--at", "6,0,1", "1,2,4"));
  EXPECT_THAT(words("$word"), ElementsAre("two words"));
  EXPECT_THAT(words("${n}x $n.5 $n. ${absent:-a b}"), ElementsAre("3x", "3.5", "3.", "a b"));
}

TEST(WordsTest, SingleQuotesAndBackslashesPreserveSpecialCharacters) {
  EXPECT_THAT(words("'$n {1}' \\$n \\{1} \\#"), ElementsAre("$n {1}", "$n", "{1}", "#"));
}

TEST(WordsTest, AWordIsMarkedBareIfItIsLiteral) {
  const absl::StatusOr<std::vector<Word>> read = read_words("-> '->' $word", testing::some_variables());
  ASSERT_TRUE(read.ok());
  EXPECT_TRUE((*read)[0].bare);
  EXPECT_FALSE((*read)[1].bare);
  EXPECT_FALSE((*read)[2].bare);
}

TEST(WordsTest, AnUnknownValueBecomesAPlaceholder) {
  EXPECT_THAT(words("--tick=$later"), ElementsAre(std::string("--tick=") + kNotKnownYet));
  EXPECT_THAT(words("\"a $later b\""), ElementsAre(std::string(1, kNotKnownYet)));
}

TEST(WordsTest, UnclosedQuotesAndBracesAreRefused) {
  for (const char* line : {"'a", "\"a", "a {1", "${n", "a\\", "\"a\\", "{", "$", "a 'b' \"c", "\"{\"}"}) {
    EXPECT_THAT(words(line).front(), HasSubstr("error: ")) << line;
  }
}

TEST(WordsTest, AWholeResultIsNotAWord) { EXPECT_THAT(words("--id $shot").front(), HasSubstr("name one of them")); }

TEST(WordsTest, AWordHasALimit) {
  Variables variables;
  ASSERT_TRUE(variables.set("half", Value::of(Json(std::string(kMaxTextBytes / 2 + 1, 'x')))).ok());
  EXPECT_TRUE(read_words("$half", variables).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(read_words("$half$half", variables).status()));
  EXPECT_TRUE(absl::IsResourceExhausted(read_words("\"$half$half\"", variables).status()));
}

TEST(WordsTest, AMillionCharactersAreReadInLinearTime) {
  EXPECT_EQ(words(std::string(1'000'000, 'x')).front().size(), 1'000'000u);
  EXPECT_THAT(words("'" + std::string(1'000'000, '\\')).front(), HasSubstr("not closed"));
  std::string many;
  for (int i = 0; i < 250'000; ++i) many += "a $n ";
  EXPECT_EQ(words(many).size(), 500'000u);
}

}  // namespace
}  // namespace locus::cli
