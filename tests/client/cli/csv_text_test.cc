#include "client/cli/csv_text.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

TEST(CsvTextTest, KeysOfVectorsAreSplitAndOthersAreNot) {
  EXPECT_EQ(csv_header({"ray", "normal", "uv", "rotation"}),
            "ray,normal.x,normal.y,normal.z,uv.u,uv.v,rotation.x,rotation.y,rotation.z,rotation.w");
}

TEST(CsvTextTest, TextIsQuotedOnlyIfNeeded) {
  const Json row = {{"a", "plain text"}, {"b", "1,2"}, {"c", "say \"hi\""}, {"d", "two\nlines"}, {"e", " blank"}};
  EXPECT_EQ(csv_line(row, {"a", "b", "c", "d", "e"}),
            "plain text,\"1,2\",\"say \"\"hi\"\"\",\"two\nlines\",\" blank\"");
}

TEST(CsvTextTest, NullAndAbsentAreEmptyCellsAndEmptyTextIsQuoted) {
  EXPECT_EQ(csv_line({{"a", nullptr}, {"c", ""}}, {"a", "b", "c"}), ",,\"\"");
}

TEST(CsvTextTest, AMissingVectorHasAsManyEmptyCellsAsParts) {
  EXPECT_EQ(csv_line({{"ray", 1}, {"point", nullptr}}, {"ray", "point"}), "1,,,");
}

TEST(CsvTextTest, ANonVectorUnderAVectorKeyGoesIntoTheFirstCell) {
  EXPECT_EQ(csv_line({{"max", 7}, {"n", 1}}, {"max", "n"}), "7,,,1");
}

TEST(CsvTextTest, NumbersAreWrittenInTheirShortestForm) {
  EXPECT_EQ(csv_line({{"t", 0.1}, {"n", 18446744073709551615ull}, {"z", 2.0}}, {"t", "n", "z"}),
            "0.1,18446744073709551615,2.0");
}

TEST(CsvTextTest, ListsAndObjectsAreOneCellOfJson) {
  EXPECT_EQ(
      csv_line({{"labels", {{"map", "delta"}}}, {"cut", {1, 2}}, {"none", Json::array()}}, {"labels", "cut", "none"}),
      "\"{\"\"map\"\":\"\"delta\"\"}\",\"[1,2]\",[]");
}

}  // namespace
}  // namespace locus::cli
