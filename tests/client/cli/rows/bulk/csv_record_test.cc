#include "client/cli/rows/bulk/csv_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
