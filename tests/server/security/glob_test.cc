#include "server/security/glob.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

// Returns whether the pattern matches the text. Reference for glob_matches(): fills a table that contains, for each
// prefix of the pattern and each prefix of the text, whether the two match.
bool matches_by_table(const std::string& pattern, const std::string& text) {
  std::vector<std::vector<bool>> table(pattern.size() + 1, std::vector<bool>(text.size() + 1, false));
  table[0][0] = true;
  for (size_t p = 1; p <= pattern.size(); ++p)
    for (size_t t = 0; t <= text.size(); ++t) {
      if (pattern[p - 1] == '*') {
        table[p][t] = table[p - 1][t] || (t > 0 && table[p][t - 1]);
      } else {
        table[p][t] = t > 0 && table[p - 1][t - 1] && (pattern[p - 1] == '?' || pattern[p - 1] == text[t - 1]);
      }
    }
  return table[pattern.size()][text.size()];
}

std::string draw(test::Random& random, const std::string& alphabet, uint64_t max_length) {
  std::string drawn;
  for (uint64_t i = random.below(max_length + 1); i > 0; --i) drawn += random.pick(alphabet);
  return drawn;
}

TEST(GlobTest, WildcardsStandForRunsAndSingleCharacters) {
  EXPECT_TRUE(glob_matches("*", ""));
  EXPECT_TRUE(glob_matches("*", "lobby"));
  EXPECT_TRUE(glob_matches("", ""));
  EXPECT_FALSE(glob_matches("", "a"));
  EXPECT_FALSE(glob_matches("?", ""));
  EXPECT_TRUE(glob_matches("arena-?", "arena-1"));
  EXPECT_FALSE(glob_matches("arena-?", "arena-12"));
  EXPECT_FALSE(glob_matches("arena", "arena2"));
  EXPECT_FALSE(glob_matches("arena", "my-arena"));
  EXPECT_TRUE(glob_matches("*-test-*", "a-test-b-test-c"));
}

TEST(GlobTest, ATextWithWildcardsIsOrdinaryText) {
  EXPECT_FALSE(glob_matches("abc", "a*c"));
  EXPECT_FALSE(glob_matches("abc", "???"));
  EXPECT_TRUE(glob_matches("a?c", "a*c"));
}

TEST(GlobTest, RandomPatternsAgreeWithTheTable) {
  for (uint64_t seed = 1; seed <= test::scaled_count(200'000); ++seed) {
    test::Random random(seed);
    const std::string pattern = draw(random, "ab*?*", 9), text = draw(random, "ab", 12);
    ASSERT_EQ(glob_matches(pattern, text), matches_by_table(pattern, text)) << pattern << " " << text << " " << seed;
  }
}

TEST(GlobTest, ManyStarsAreAnsweredWithoutExponentialWork) {
  std::string pattern;
  for (int i = 0; i < 100; ++i) pattern += "*a";
  EXPECT_FALSE(glob_matches(pattern + "b", std::string(256, 'a')));  // an algorithm with 2^100 steps would never end
  EXPECT_TRUE(glob_matches(pattern, std::string(256, 'a')));
}

TEST(GlobTest, OnlyWildcardsMakeAGlob) {
  EXPECT_TRUE(is_glob("token:*"));
  EXPECT_TRUE(is_glob("token:?"));
  EXPECT_FALSE(is_glob("token:[ci]"));
}

}  // namespace
}  // namespace locus::server
