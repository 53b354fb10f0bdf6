#include "client/cli/script/expression.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/script/script_values.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

// Evaluates the expression at the start of `text`. Returns its value as text. If the expression is not valid, returns
// "error: " and the reason; if other text follows the expression, returns "rest: " and that text.
std::string worth(const std::string& text) {
  static const auto& variables = *new Variables(testing::some_variables());
  Cursor cursor(text);
  const absl::StatusOr<Value> value = read_expression(cursor, variables);
  if (!value.ok()) return "error: " + std::string(value.status().message());
  cursor.skip_blanks();
  if (!cursor.ended()) return "rest: " + std::string(cursor.rest());
  return shown(*value);
}

TEST(ExpressionTest, ProductsBindTighterThanSums) {
  EXPECT_EQ(worth("1 + 2 * 3"), "7");
  EXPECT_EQ(worth("(1 + 2) * 3"), "9");
  EXPECT_EQ(worth("10 - 4 - 3"), "3");
  EXPECT_EQ(worth("7 / 2"), "3.5");
  EXPECT_EQ(worth("7 % 4 * 2"), "6");
  EXPECT_EQ(worth("-3 - -4"), "1");
  EXPECT_EQ(worth("- - 3"), "3");
  EXPECT_EQ(worth("5-2"), "3");
  EXPECT_EQ(worth("2*-3"), "-6");
  EXPECT_EQ(worth("{1 + 1} * 2"), "4");
}

TEST(ExpressionTest, ThreeNumbersWithCommasAreOneVector) {
  EXPECT_EQ(worth("1,2,3 + 1,1,1"), "2,3,4");
  EXPECT_EQ(worth("-1,2,-3"), "-1,2,-3");
  EXPECT_EQ(worth("1,2,3 - 1,2,3"), "0,0,0");
  EXPECT_EQ(worth("1,2,3 * 2"), "2,4,6");
  EXPECT_EQ(worth("2 * 1,2,3"), "2,4,6");
  EXPECT_EQ(worth("1,2,3 / 2"), "0.5,1,1.5");
  EXPECT_EQ(worth("- 1,2,3"), "-1,-2,-3");
  EXPECT_EQ(worth("$p + (0, $n, 1)"), "1,5,4");
  EXPECT_EQ(worth("0,0,0,1"), "0,0,0,1") << "a quaternion is a list";
}

TEST(ExpressionTest, VectorsAreRefusedByOperatorsForNumbers) {
  for (const char* text :
       {"1,2,3 + 1", "1,2,3 * 1,2,3", "1 / 1,2,3", "1,2,3 % 2", "$word + 1", "true + 1", "null * 2"}) {
    EXPECT_THAT(worth(text), HasSubstr("error: ")) << text;
  }
}

TEST(ExpressionTest, VariablesHaveFieldsAndEntries) {
  EXPECT_EQ(worth("$shot.t * 2"), "139");
  EXPECT_EQ(worth("$shot.point - 0,0,0.5"), "0,0,30");
  EXPECT_EQ(worth("$near.id[1]"), "9223372036854775809");
  EXPECT_EQ(worth("$near.id[$n - 1]"), "100");
  EXPECT_EQ(worth("$near.id[$near.count - 1] + 1"), "101");
  EXPECT_EQ(worth("$near.hits[0].id"), "7");
  EXPECT_EQ(worth("$shot.min[2]"), "3");
  EXPECT_EQ(worth("$p[0] + $p[1]"), "3");
  EXPECT_EQ(worth("${n} + ${shot.t}"), "72.5");
}

TEST(ExpressionTest, IdsOf64BitsAreNotRounded) {
  EXPECT_EQ(worth("$big + 1"), "9223372036854775810");
  EXPECT_EQ(worth("$near.id[1] - 9223372036854775808"), "1");
}

TEST(ExpressionTest, ADefaultReplacesAMissingVariableOrValue) {
  EXPECT_EQ(worth("${absent:-7} + 1"), "8");
  EXPECT_EQ(worth("${absent.field[2]:-7}"), "7");
  EXPECT_EQ(worth("${n:-7}"), "3");
  EXPECT_EQ(worth("${miss.t:-100}"), "100");
  EXPECT_EQ(worth("${none.id:-0}"), "0");
  EXPECT_EQ(worth("${absent:-}"), "an empty text or list");
}

TEST(ExpressionTest, TextsAreQuotedOrBare) {
  EXPECT_EQ(worth("arena"), "arena");
  EXPECT_EQ(worth("'a b # $n'"), "a b # $n");
  EXPECT_EQ(worth("\"n is $n, twice {$n * 2}\""), "n is 3, twice 6");
  EXPECT_EQ(worth("\"\\\"\\$\\{\\\\\""), "\"${\\");
  EXPECT_EQ(worth("\"x {\"y {1 + 1}\"}\""), "x y 2");
  EXPECT_EQ(worth("true"), "true");
}

TEST(ExpressionTest, FunctionsWork) {
  EXPECT_EQ(worth("length(3,4,0)"), "5");
  EXPECT_EQ(worth("length((3, 4, 0))"), "5");
  EXPECT_EQ(worth("dot(1,2,3, 4,5,6)"), "32");
  EXPECT_EQ(worth("cross(1,0,0, 0,1,0)"), "0,0,1");
  EXPECT_EQ(worth("unit(0,0,9)"), "0,0,1");
  EXPECT_EQ(worth("min(3, 1, 2)"), "1");
  EXPECT_EQ(worth("max(1,2)"), "2");
  EXPECT_EQ(worth("max(1,2,3)"), "3");
  EXPECT_EQ(worth("abs(-7)"), "7");
  EXPECT_EQ(worth("abs(-1,2,-3)"), "1,2,3");
  EXPECT_EQ(worth("sqrt(2.25)"), "1.5");
  EXPECT_EQ(worth("floor(-1.5)"), "-2");
  EXPECT_EQ(worth("round(2.5)"), "3");
  EXPECT_EQ(worth("len($near.id)"), "3");
  EXPECT_EQ(worth("len('four')"), "4");
  EXPECT_EQ(worth("cos(0)"), "1");
  EXPECT_EQ(worth("round(sin(radians(90)))"), "1");
}

TEST(ExpressionTest, FunctionsRefuseWrongArguments) {
  EXPECT_THAT(worth("nope(1)"), HasSubstr("there is no function nope; the functions are abs, cos, cross"));
  EXPECT_EQ(worth("dot(1,2,3)"), "error: dot() takes 2 arguments, not 1");
  EXPECT_EQ(worth("sqrt()"), "error: sqrt() takes 1 argument, not 0");
  EXPECT_THAT(worth("sqrt(-1)"), HasSubstr("not a finite number"));
  EXPECT_THAT(worth("unit(0,0,0)"), HasSubstr("no direction"));
  EXPECT_THAT(worth("length(7)"), HasSubstr("7 is not a vector x,y,z"));
  EXPECT_THAT(worth("round(1e30)"), HasSubstr("64 bits"));
}

TEST(ExpressionTest, UnknownValuesMakeUnknownResults) {
  for (const char* text : {"$later + 1", "$later.id[0] * 2", "(0, $later, 1)", "\"x $later\"", "max(1, $later)",
                           "$p[$later]", "-$later"}) {
    EXPECT_EQ(worth(text), "an unknown value") << text;
  }
  EXPECT_THAT(worth("$later + nope(1)"), HasSubstr("error: ")) << "mistakes are found all the same";
}

TEST(ExpressionTest, AVariableThatIsNotDefinedIsNamed) {
  EXPECT_EQ(worth("1 + $nobody.id"),
            "error: $nobody is not defined: set it with let, `-> nobody` or --set nobody=VALUE");
  EXPECT_THAT(worth("${nobody}"), HasSubstr("$nobody is not defined"));
}

TEST(ExpressionTest, MistakesNameWhatWasFound) {
  EXPECT_EQ(worth(""), "error: expected a value, found the end of the line");
  EXPECT_EQ(worth("1 +"), "error: expected a value, found the end of the line");
  EXPECT_EQ(worth("(1"), "error: expected `)`, found the end of the line");
  EXPECT_EQ(worth("* 2"), "error: expected a value, found `* 2`");
  EXPECT_EQ(worth("$"), "error: expected a name behind `$`, found the end of the line");
  EXPECT_THAT(worth("'open"), HasSubstr("not closed"));
  EXPECT_THAT(worth("\"open"), HasSubstr("not closed"));
  EXPECT_THAT(worth("\"open {1\""), HasSubstr("error: "));
  EXPECT_THAT(worth("\"\\q\""), HasSubstr("\\q is not an escape sequence"));
  EXPECT_THAT(worth("${n"), HasSubstr("expected `}` or `:-`"));
  EXPECT_THAT(worth("${n:-7"), HasSubstr("} is missing"));
  EXPECT_THAT(worth("$p[1"), HasSubstr("expected `]`"));
  EXPECT_THAT(worth("max(1 2)"), HasSubstr("expected `)`"));
  EXPECT_THAT(worth("1 / 0"), HasSubstr("division by zero"));
  EXPECT_THAT(worth("1,2,3 / 0"), HasSubstr("division by zero"));
  EXPECT_THAT(worth("12abc"), HasSubstr("`12abc` is not a number"));
  EXPECT_THAT(worth("99999999999999999999"), HasSubstr("is not a number of at most 64 bits"));
  EXPECT_EQ(worth("1 ] 2"), "rest: ] 2");
}

TEST(ExpressionTest, NestingIsBounded) {
  const auto nested = [](size_t depth, const std::string& open, const std::string& close) {
    std::string text = "1";
    for (size_t i = 0; i < depth; ++i) text = open + text + close;
    return text;
  };
  EXPECT_EQ(worth(nested(kMaxExpressionDepth, "(", ")")), "1");
  for (const auto& [open, close] : std::vector<std::pair<std::string, std::string>>{
           {"(", ")"}, {"{", "}"}, {"abs(", ")"}, {"$p[", "]"}, {"\"{", "}\""}}) {
    EXPECT_THAT(worth(nested(kMaxExpressionDepth + 1, open, close)), HasSubstr("nested deeper than 64")) << open;
  }
  EXPECT_THAT(worth(std::string(1'000'000, '(')), HasSubstr("nested deeper than 64"));
  EXPECT_THAT(worth(std::string(1'000'000, '{')), HasSubstr("nested deeper than 64"));
}

TEST(ExpressionTest, LongChainsDoNotRecurse) {
  std::string sum = "0";
  for (int i = 0; i < 100'000; ++i) sum += "+1";
  EXPECT_EQ(worth(sum), "100000");
  EXPECT_EQ(worth(std::string(1'000'000, '-') + " 1"), "1");
  std::string list = "1";
  for (int i = 0; i < 100'000; ++i) list += ",1";
  EXPECT_EQ(worth("len((" + list + "))"), "100001");
}

}  // namespace
}  // namespace locus::cli
