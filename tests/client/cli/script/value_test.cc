#include "client/cli/script/value.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/script/script_values.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

class ValueTest : public ::testing::Test {
 protected:
  const Value& variable(const std::string& name) const { return *variables_.find(name); }
  std::string field(const std::string& name, const std::string& field_name) const {
    const absl::StatusOr<Value> value = field_of(variable(name), field_name);
    return value.ok() ? shown(*value) : std::string(value.status().message());
  }

  const Variables variables_ = testing::some_variables();
};

TEST_F(ValueTest, AResultHasFactsColumnsAndACount) {
  EXPECT_EQ(field("near", "revision"), "12");
  EXPECT_EQ(field("near", "epoch"), "18446744073709551615");
  EXPECT_EQ(field("near", "id"), "7,9223372036854775809,100");
  EXPECT_EQ(field("near", "count"), "3");
  EXPECT_EQ(field("none", "count"), "0");
}

TEST_F(ValueTest, RowsAreAFieldUnderTheirName) {
  const absl::StatusOr<Value> row = entry_of(*field_of(variable("near"), "hits"), absl::int128(1));
  ASSERT_TRUE(row.ok());
  EXPECT_EQ(shown(*field_of(*row, "id")), "9223372036854775809");
}

TEST_F(ValueTest, AColumnOfOneRowIsItsEntryAndItsRow) {
  const Value id = *field_of(variable("shot"), "id");
  EXPECT_EQ(text_of(*number_of(id)), "7");
  EXPECT_EQ(text_of(*number_of(*entry_of(id, absl::int128(0)))), "7");
  const Value point = *field_of(variable("shot"), "point");
  EXPECT_EQ(*vector_of(point), (Vector{0, 0, 30.5}));
  EXPECT_EQ(shown(*entry_of(*entry_of(point, absl::int128(0)), absl::int128(2))), "30.5");
}

TEST_F(ValueTest, AColumnOfSeveralRowsIsNotANumber) {
  const absl::StatusOr<Number> number = number_of(*field_of(variable("near"), "id"));
  EXPECT_THAT(std::string(number.status().message()), HasSubstr("id has 3 rows: choose one, as in id[0]"));
}

TEST_F(ValueTest, AColumnOfNoRowsIsEmptyWhateverItsName) {
  EXPECT_EQ(*size_of(*field_of(variable("none"), "id")), 0u);
  EXPECT_FALSE(number_of(*field_of(variable("none"), "id")).ok());
}

TEST_F(ValueTest, AMissingFieldIsReportedWithTheExistingNames) {
  EXPECT_EQ(field("near", "revison"), "there is no field revison; there are epoch, revision, min, hits, count, id");
  EXPECT_THAT(field("n", "x"), HasSubstr("3 is not a record"));
}

TEST_F(ValueTest, AnEntryBeyondTheEndIsRefused) {
  for (const Number& index : {Number(absl::int128(3)), Number(absl::int128(-1)), Number(0.5)}) {
    EXPECT_FALSE(entry_of(*field_of(variable("near"), "id"), index).ok()) << text_of(index);
  }
  EXPECT_FALSE(entry_of(variable("n"), absl::int128(0)).ok());
  EXPECT_FALSE(entry_of(variable("shot"), absl::int128(0)).ok()) << "a whole result";
}

TEST_F(ValueTest, TextsOfNumbersAndVectorsAreTreatedAsSuch) {
  EXPECT_EQ(text_of(*number_of(variable("big"))), "9223372036854775809");
  EXPECT_EQ(*vector_of(Value::of(Json("1,2.5,-3"))), (Vector{1, 2.5, -3}));
  EXPECT_FALSE(operand_of(Value::of(Json("1,2"))).ok());
  EXPECT_FALSE(operand_of(Value::of(Json("1,2,x"))).ok());
}

TEST_F(ValueTest, AMissIsNoNumber) {
  EXPECT_THAT(std::string(number_of(*field_of(variable("miss"), "t")).status().message()),
              HasSubstr("null is not a number"));
}

TEST_F(ValueTest, AsAWordAListHasCommasAndAResultIsRefused) {
  EXPECT_EQ(*text_of(variable("p")), "1,2,3");
  EXPECT_EQ(*text_of(Value::of(Vector{0.5, -1, 1e30})), "0.5,-1,1e+30");
  EXPECT_THAT(std::string(text_of(variable("shot")).status().message()), HasSubstr("name one of them: epoch"));
}

TEST_F(ValueTest, MessagesStayReadable) {
  EXPECT_LT(shown(Value::of(Json(std::string(1'000'000, 'x')))).size(), 300u);
  EXPECT_EQ(shown(*field_of(variable("none"), "id")), "empty: there are no rows");
  EXPECT_EQ(shown(variable("later")), "an unknown value");
}

TEST_F(ValueTest, FieldsOfUnknownValuesAreUnknown) {
  EXPECT_FALSE(field_of(variable("later"), "id")->known());
  EXPECT_FALSE(entry_of(variable("later"), absl::int128(7))->known());
}

}  // namespace
}  // namespace locus::cli
