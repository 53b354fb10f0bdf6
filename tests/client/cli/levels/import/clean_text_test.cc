#include "client/cli/levels/import/clean_text.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

TEST(CleanTextTest, ControlCharactersOfOneAndTwoBytesAreReplaced) {
  EXPECT_EQ(clean_text("a\x1B[2J\n\x7F", 100), "a_[2J__");
  EXPECT_EQ(clean_text("a\xC2\x9B\x32J\xC2\xA0", 100), "a__2J\xC2\xA0");
}

TEST(CleanTextTest, TextThatIsNotUtf8LosesItsHighBytes) { EXPECT_EQ(clean_text("\xC2\x9B\xFF\xE9t", 100), "____t"); }

TEST(CleanTextTest, TextIsTruncatedAtACharacter) {
  EXPECT_EQ(clean_text("abc", 2), "ab");
  EXPECT_EQ(clean_text("a\xC3\xA9", 2), "a");
  EXPECT_EQ(clean_text("", 2), "");
}

}  // namespace
}  // namespace locus::cli
