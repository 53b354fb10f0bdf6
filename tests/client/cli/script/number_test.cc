#include "client/cli/script/number.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace locus::cli {
namespace {

Number number(const std::string& text) {
  const std::optional<Number> parsed = parse_number(text);
  EXPECT_TRUE(parsed.has_value()) << text;
  return parsed.value_or(Number(absl::int128(0)));
}

TEST(NumberTest, IntegersAreExactOverAllIds) {
  EXPECT_EQ(text_of(number("18446744073709551615")), "18446744073709551615");
  EXPECT_EQ(text_of(number("-9223372036854775808")), "-9223372036854775808");
  EXPECT_EQ(text_of(number("0x8000000000000001")), "9223372036854775809");
  EXPECT_NE(compare(number("9223372036854775809"), number("9223372036854775808")), 0);
}

TEST(NumberTest, TextsThatAreNotNumbersGiveNone) {
  for (const char* text : {"", "-", ".", "abc", "1x", "inf", "nan", "-inf", "1e999", "18446744073709551616",
                           "-9223372036854775809", "--1", "+1", "1,2", "0x", "1.2.3"}) {
    EXPECT_EQ(parse_number(text), std::nullopt) << text;
  }
}

TEST(NumberTest, DoublesPrintInTheFewestDigitsThatReadBack) {
  for (const char* text : {"0.1", "69.5", "1e+30", "-2.5e-07"}) EXPECT_EQ(text_of(number(text)), text);
  EXPECT_EQ(text_of(number("30.0")), "30");
}

TEST(NumberTest, DivisionOfIntegersIsExactIfTheQuotientIsIntegral) {
  EXPECT_EQ(text_of(*divide(number("18446744073709551614"), number("2"))), "9223372036854775807");
  EXPECT_EQ(text_of(*divide(number("7"), number("2"))), "3.5");
  EXPECT_EQ(text_of(*modulo(number("-7"), number("3"))), "2");
}

TEST(NumberTest, ResultsBeyond64BitsAreRefusedAndNotRounded) {
  const Number most = number("18446744073709551615");
  const Number least = number("-9223372036854775808");
  EXPECT_FALSE(add(most, number("1")).ok());
  EXPECT_FALSE(subtract(least, number("1")).ok());
  EXPECT_FALSE(multiply(most, most).ok());
  EXPECT_FALSE(multiply(least, most).ok());
  EXPECT_EQ(text_of(*multiply(most, number("1"))), "18446744073709551615");
  EXPECT_EQ(text_of(*subtract(most, most)), "0");
}

TEST(NumberTest, DivisionByZeroAndResultsThatAreNotFiniteAreRefused) {
  EXPECT_FALSE(divide(number("1"), number("0")).ok());
  EXPECT_FALSE(divide(number("1.5"), number("0.0")).ok());
  EXPECT_FALSE(modulo(number("1"), number("0")).ok());
  EXPECT_FALSE(modulo(number("1.5"), number("1")).ok());
  EXPECT_FALSE(multiply(number("1e300"), number("1e300")).ok());
  EXPECT_FALSE(finite(std::numeric_limits<double>::quiet_NaN()).ok());
}

TEST(NumberTest, AnIntegerAndADoubleCompareExactly) {
  // If the integer were converted to double, it would equal the other number in each of the first three comparisons.
  EXPECT_GT(compare(number("9007199254740993"), Number(9007199254740992.0)), 0);
  EXPECT_EQ(compare(number("9007199254740992"), Number(9007199254740992.0)), 0);
  EXPECT_LT(compare(number("18446744073709551615"), Number(18446744073709551616.0)), 0);
  EXPECT_LT(compare(number("2"), Number(2.5)), 0);
  EXPECT_GT(compare(Number(2.5), number("2")), 0);
  EXPECT_LT(compare(number("-3"), Number(-2.5)), 0);
  EXPECT_LT(compare(number("1"), Number(1e300)), 0);
  EXPECT_GT(compare(number("1"), Number(-1e300)), 0);
}

TEST(NumberTest, JsonKeepsIntegersAndDoublesApart) {
  EXPECT_EQ(json_of(number("18446744073709551615")), Json(std::numeric_limits<uint64_t>::max()));
  EXPECT_EQ(json_of(number("-1")), Json(-1));
  EXPECT_EQ(number_from(Json("7")), std::nullopt) << "a text";
  EXPECT_EQ(number_from(Json(true)), std::nullopt);
  EXPECT_EQ(number_from(Json(7)), number("7"));
}

}  // namespace
}  // namespace locus::cli
