#include "client/cli/script/expectation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/script/script_values.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// Returns "" if the expectation is met, otherwise the reason why not. If the text is not a valid expectation, returns
// "form: " and the error.
std::string verdict(const std::string& text) {
  const absl::StatusOr<Expectation> expectation = read_expectation(text, testing::some_variables());
  if (!expectation.ok()) return "form: " + std::string(expectation.status().message());
  return std::string(verify(*expectation).message());
}

TEST(ExpectationTest, NumbersCompareInEveryWay) {
  for (const char* text : {"1 == 1", "1 != 2", "1 < 2", "2 <= 2", "2 > 1", "2 >= 2", "0.1 + 0.2 == 0.3 within 1e-9",
                           "$shot.t == 69.5", "$shot.t < 70", "1 == 1.0", "-1 < 0.5"}) {
    EXPECT_EQ(verdict(text), "") << text;
  }
  for (const char* text :
       {"1 == 2", "1 != 1", "2 < 2", "3 <= 2", "1 > 1", "1 >= 2", "1 == 2 within 0.5", "0.1 + 0.2 == 0.3"}) {
    EXPECT_THAT(verdict(text), StartsWith(std::string("expected ") + text + ", but it is ")) << text;
  }
}

TEST(ExpectationTest, AFailureSaysWhatWasFound) {
  EXPECT_EQ(verdict("$shot.id == 2"), "expected $shot.id == 2, but it is 7");
  EXPECT_EQ(verdict("$shot.id == $n  # three"), "expected $shot.id == $n, which is 3, but it is 7");
  EXPECT_EQ(verdict("$near.id contains 8"), "expected $near.id contains 8, but it is 7,9223372036854775809,100");
  EXPECT_EQ(verdict("$none.id == 7"), "expected $none.id == 7, but it is empty: there are no rows");
  EXPECT_EQ(verdict("$miss.t < 5"), "expected $miss.t < 5, but it is null: null is not a number or a vector");
}

TEST(ExpectationTest, IdsOf64BitsCompareExactly) {
  EXPECT_EQ(verdict("$big == 9223372036854775809"), "");
  EXPECT_NE(verdict("$big == 9223372036854775808"), "") << "equal as doubles";
  EXPECT_EQ(verdict("$near.id contains 9223372036854775809"), "");
  EXPECT_NE(verdict("$near.id contains 9223372036854775808"), "");
  EXPECT_EQ(verdict("$near.id == 7,9223372036854775809,100"), "");
  EXPECT_NE(verdict("$near.id == 7,9223372036854775808,100"), "");
}

TEST(ExpectationTest, VectorsListsTextsAndTruthCompare) {
  EXPECT_EQ(verdict("$shot.point == 0,0,30.5"), "");
  EXPECT_EQ(verdict("$shot.point == 0,0,30 within 0.5"), "");
  EXPECT_NE(verdict("$shot.point == 0,0,30 within 0.4"), "");
  EXPECT_EQ(verdict("'1,2,3' == $p"), "");
  EXPECT_EQ(verdict("$shot.hit == true"), "");
  EXPECT_EQ(verdict("$miss.t == null"), "");
  EXPECT_NE(verdict("$shot.t == null"), "");
  EXPECT_EQ(verdict("$word == 'two words'"), "");
  EXPECT_EQ(verdict("$word contains two"), "");
  EXPECT_NE(verdict("$word contains three"), "");
  EXPECT_EQ(verdict("$shot.id contains 7"), "") << "one row is a column too";
  EXPECT_NE(verdict("$near.id == 7"), "");
}

TEST(ExpectationTest, AWrongFormIsNamed) {
  EXPECT_EQ(verdict("1"), "form: expected one of == != < <= > >= contains, found the end of the line");
  EXPECT_EQ(verdict("1 = 1"), "form: expected one of == != < <= > >= contains, found `= 1`");
  EXPECT_EQ(verdict("1 == 1 1"), "form: expected the end of the line, found `1`");
  EXPECT_EQ(verdict("1 < 1 within 2"), "form: `within` is allowed only with ==");
  EXPECT_THAT(verdict("1 == "), HasSubstr("form: expected a value"));
  EXPECT_THAT(verdict("$nobody == 1"), HasSubstr("form: $nobody is not defined"));
}

TEST(ExpectationTest, ANegativeToleranceHoldsForNothing) {
  EXPECT_THAT(verdict("1 == 1 within -1"), HasSubstr("must not be negative"));
}

}  // namespace
}  // namespace locus::cli
