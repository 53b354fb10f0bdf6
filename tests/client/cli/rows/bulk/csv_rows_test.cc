#include "client/cli/rows/bulk/csv_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const RowSchema& schema() {
  static const auto& schema =
      *new RowSchema{{.name = "from", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
                     {.name = "max_t", .kind = FieldKind::kDistance},
                     {.name = "mask", .kind = FieldKind::kBits, .option = "--mask"}};
  return schema;
}

std::string header_refusal(absl::string_view header) {
  CsvRows rows(schema());
  return std::string(rows.read_header(header).message());
}

std::string row_refusal(absl::string_view row) {
  CsvRows rows(schema());
  EXPECT_TRUE(rows.read_header("from.x,from.y,from.z,max_t").ok());
  RowBuilder builder(schema());
  RowBatch batch = builder.empty_batch(0);
  const absl::Status status = rows.read_row(row, 2, builder, batch);
  EXPECT_EQ(batch.rows(), 0u);
  return std::string(status.message());
}

TEST(CsvRowsTest, ColumnsMayComeInAnyOrderAndOptionalOnesMayBeEmptyOrAbsent) {
  CsvRows rows(schema());
  ASSERT_TRUE(rows.read_header(" max-t ,\"from.z\",from.x,from.y").ok());
  RowBuilder builder(schema());
  RowBatch batch = builder.empty_batch(0);
  ASSERT_TRUE(rows.read_row("9, 3 ,\"1\",2", 2, builder, batch).ok());
  ASSERT_TRUE(rows.read_row(",6,4,5", 3, builder, batch).ok());
  EXPECT_THAT(batch.columns[0].numbers, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(batch.columns[1].given, ElementsAre(1, 0));
  EXPECT_THAT(batch.columns[2].given, ElementsAre(0, 0));
}

TEST(CsvRowsTest, AnUnknownColumnIsRefusedWithTheKnownOnes) {
  EXPECT_EQ(header_refusal("from.x,from.y,from.z,color"),
            "unknown column 'color'; a header line names columns out of: from.x, from.y, from.z, max_t, mask");
  EXPECT_THAT(header_refusal("from,max_t"), StartsWith("unknown column 'from'")) << "a vector has three columns";
  EXPECT_THAT(header_refusal("from.x;from.y;from.z"), StartsWith("unknown column 'from.x;from.y;from.z'"));
  EXPECT_THAT(header_refusal("1,2,3"), StartsWith("unknown column '1'"));
  EXPECT_THAT(header_refusal("from.x,,from.y,from.z"), StartsWith("unknown column ''"));
}

TEST(CsvRowsTest, AMissingRequiredColumnIsReported) {
  EXPECT_THAT(header_refusal("from.x,from.z"), StartsWith("no column from.y; "));
  EXPECT_THAT(header_refusal("max_t"), StartsWith("no column from.x; "));
}

TEST(CsvRowsTest, ARepeatedColumnOrOneGivenByAnOptionIsRefused) {
  EXPECT_EQ(header_refusal("from.x,from.y,from.z,max_t,max-t"), "column max_t is there twice");
  EXPECT_EQ(header_refusal("from.x,from.y,from.z,mask"),
            "the column mask and the option --mask are both given: leave one of them out");
}

TEST(CsvRowsTest, RowsOfWrongLengthOrWithWrongCellsAreRefused) {
  EXPECT_EQ(row_refusal("1,2,3"), "has 3 fields, the header names 4");
  EXPECT_EQ(row_refusal("1,2,3,4,5"), "has 5 fields, the header names 4");
  EXPECT_EQ(row_refusal("1,abc,3,4"), "from.y: 'abc' is no number");
  EXPECT_EQ(row_refusal("1,,3,4"), "from.y: is missing, but other parts are given");
  EXPECT_EQ(row_refusal(",,,4"), "from: is missing");
  EXPECT_THAT(row_refusal("1,2\"3,3,4"), HasSubstr("a quote in the middle"));
}

std::vector<std::string> fields_of(absl::string_view record) {
  std::vector<std::string> fields;
  const absl::Status split = split_csv_record(record, fields);
  EXPECT_TRUE(split.ok()) << split;
  return fields;
}

TEST(CsvRecordTest, CommasSeparateFields) { EXPECT_THAT(fields_of("1,2,3"), ElementsAre("1", "2", "3")); }

TEST(CsvRecordTest, AnEmptyRecordIsOneEmptyField) { EXPECT_THAT(fields_of(""), ElementsAre("")); }

TEST(CsvRecordTest, ACommaAtTheEndIsFollowedByAnEmptyField) { EXPECT_THAT(fields_of(",a,"), ElementsAre("", "a", "")); }

TEST(CsvRecordTest, QuotedFieldsMayHaveCommasQuotesAndLineBreaks) {
  EXPECT_THAT(fields_of("\"a,b\",\"say \"\"hi\"\"\",\"two\r\nlines\",\"\""),
              ElementsAre("a,b", "say \"hi\"", "two\r\nlines", ""));
}

TEST(CsvRecordTest, BlanksAroundAnUnquotedFieldAreDroppedAndThoseInQuotesKept) {
  EXPECT_THAT(fields_of(" 1 ,\t2,\" 3 \""), ElementsAre("1", "2", " 3 "));
}

TEST(CsvRecordTest, AQuoteInTheMiddleOfAFieldIsRefused) {
  for (const char* record : {"1,a\"b", "1,\"a\"b", "1,\"a", "1,\"a\"\"", "1, \"a\""}) {
    std::vector<std::string> fields;
    EXPECT_THAT(std::string(split_csv_record(record, fields).message()), HasSubstr("field 2: a quote in the middle"))
        << record;
  }
}

}  // namespace
}  // namespace locus::cli
