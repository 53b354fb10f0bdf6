#include "client/cli/rows/bulk/ndjson_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const RowSchema& ray_schema() {
  static const auto& schema =
      *new RowSchema{{.name = "from", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
                     {.name = "max_t", .kind = FieldKind::kDistance},
                     {.name = "id", .kind = FieldKind::kId},
                     {.name = "dir", .kind = FieldKind::kFloat, .parts = "xyz", .option = "--dir"}};
  return schema;
}

absl::Status read(absl::string_view text, RowBatch& batch) {
  RowBuilder builder(ray_schema());
  if (batch.columns.empty()) batch = builder.empty_batch(0);
  return read_ndjson_row(ray_schema(), text, 1, builder, batch);
}

std::string refusal(absl::string_view text) {
  RowBatch batch;
  const absl::Status status = read(text, batch);
  EXPECT_FALSE(status.ok()) << text;
  EXPECT_EQ(batch.rows(), 0u) << text;
  return std::string(status.message());
}

TEST(NdjsonRowsTest, VectorsMayBeListsOrParts) {
  RowBatch batch;
  ASSERT_TRUE(read(R"({"from": [1, 2.5, -3e2], "max-t": 7})", batch).ok());
  ASSERT_TRUE(read(R"(  {"from.x": 1, "from.z": 3, "from.y": 2}  )", batch).ok());
  EXPECT_THAT(batch.columns[0].numbers, ElementsAre(1, 2.5, -300, 1, 2, 3));
  EXPECT_THAT(batch.columns[1].given, ElementsAre(1, 0));
}

TEST(NdjsonRowsTest, IdsAreExactAsNumbersAndAsStrings) {
  RowBatch batch;
  ASSERT_TRUE(read(R"({"from":[0,0,0],"id":9007199254740993})", batch).ok());
  ASSERT_TRUE(read(R"({"from":[0,0,0],"id":"18446744073709551615"})", batch).ok());
  ASSERT_TRUE(read(R"({"from":[0,0,0],"id":18446744073709551615})", batch).ok());
  EXPECT_THAT(batch.columns[2].integers, ElementsAre(9007199254740993ull, ~0ull, ~0ull));
}

TEST(NdjsonRowsTest, NullMeansThatTheValueIsNotGiven) {
  RowBatch batch;
  ASSERT_TRUE(read(R"({"from":[0,0,0],"id":null,"max_t":null})", batch).ok());
  EXPECT_THAT(batch.columns[2].given, ElementsAre(0));
  EXPECT_EQ(refusal(R"({"from":null})"), "from: is missing");
}

TEST(NdjsonRowsTest, IdsThatAreNotIntegersAreRefused) {
  for (const char* id : {"7.0", "-1", "18446744073709551616", "1e3", "\"7.0\"", "\"\"", "true", "[7]", "{}"}) {
    EXPECT_THAT(refusal(std::string(R"({"from":[0,0,0],"id":)") + id + "}"), HasSubstr("id: ")) << id;
  }
}

TEST(NdjsonRowsTest, InvalidJsonIsReportedWithItsColumn) {
  EXPECT_EQ(refusal(R"({"from":[0,0,0])"), "no JSON at column 16");
  for (const char* text : {"{", "{\"from\":[0,0,0]}}", "{\"from\":[0,0,0],}", "{'from':1}", "{\"from\":[0,0,NaN]}",
                           "{\"from\":[0 0 0]}", "\"", "{\"from\":[01,0,0]}", "{\"\xff\":1}", "\x00"}) {
    EXPECT_THAT(refusal(text), HasSubstr("no JSON at column")) << text;
  }
  EXPECT_THAT(refusal(R"({"from":[1e999,0,0]})"), HasSubstr("from: the number at column 14 is beyond any double"));
}

TEST(NdjsonRowsTest, ValuesOtherThanAnObjectAreRefused) {
  EXPECT_EQ(refusal("[1,2,3]"), "a list, not an object in braces");
  EXPECT_EQ(refusal("null"), "null, not an object in braces");
  for (const char* text : {"7", "-7", "7.5", "\"x\"", "true"}) EXPECT_FALSE(refusal(text).empty()) << text;
}

TEST(NdjsonRowsTest, ValuesOfTheWrongTypeAreRefusedWithTheirKey) {
  EXPECT_EQ(refusal(R"({"from":[1,2]})"), "from: has 2 numbers, not 3");
  EXPECT_EQ(refusal(R"({"from":[1,2,3,4]})"), "from: has more than 3 numbers");
  EXPECT_EQ(refusal(R"({"from":[1,[2],3]})"), "from: a list is no value here");
  EXPECT_EQ(refusal(R"({"from":[1,null,3]})"), "from: null in a list");
  EXPECT_EQ(refusal(R"({"from":7})"), "from: a vector is a list of numbers");
  EXPECT_EQ(refusal(R"({"from":{"x":1}})"), "from: an object is no value here; a vector is a list of numbers");
  EXPECT_EQ(refusal(R"({"from":["1",2,3]})"), "from.x: a string is no number");
  EXPECT_EQ(refusal(R"({"from":[1,1e308,3]})"), "from.y: 1e+308 is beyond 1e+09");
}

TEST(NdjsonRowsTest, KeysThatAreUnknownRepeatedOrGivenByAnOptionAreRefused) {
  EXPECT_THAT(refusal(R"({"form":[1,2,3]})"),
              HasSubstr("unknown key 'form'; known are: from.x, from.y, from.z, max_t"));
  EXPECT_EQ(refusal(R"({"from":[1,2,3],"from":[1,2,3]})"), "from.x: is given twice");
  EXPECT_EQ(refusal(R"({"from":[1,2,3],"dir":[1,2,3]})"),
            "the key dir and the option --dir are both given: leave one of them out");
}

TEST(NdjsonRowsTest, DeepNestingIsRefusedAtItsFirstLevel) {
  EXPECT_EQ(refusal(R"({"from":)" + std::string(60000, '[')), "from: a list is no value here");
  EXPECT_EQ(refusal(std::string(60000, '[')), "a list, not an object in braces");
}

}  // namespace
}  // namespace locus::cli
