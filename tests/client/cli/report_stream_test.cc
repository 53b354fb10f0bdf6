#include "client/cli/report_stream.h"

#include <gtest/gtest.h>

#include <sstream>

namespace locus::cli {
namespace {

Json row(int number, const std::string& text) { return {{"n", number}, {"text", text}}; }

TEST(ReportStreamTest, RowsAreWrittenBeforeTheReportEnds) {
  for (const Format format : {Format::kJson, Format::kNdjson, Format::kCsv}) {
    std::ostringstream out;
    ReportStream stream(out, format, {.rows_name = "rows", .keys = {"n", "text"}});
    stream.begin({{"tick", 1}});
    stream.add(row(7, "seven"));
    EXPECT_NE(out.str().find("seven"), std::string::npos);
    stream.end();
  }
}

TEST(ReportStreamTest, JsonWritesLateFactsAfterTheRows) {
  std::ostringstream out;
  ReportStream stream(out, Format::kJson, {.rows_name = "rows", .keys = {}});
  stream.begin({{"tick", 1}});
  stream.add(row(1, "a"));
  stream.add(row(2, "b"));
  stream.end({{"cut", 2}});
  EXPECT_EQ(out.str(),
            "{\n  \"tick\": 1,\n  \"rows\": [\n    {\"n\":1,\"text\":\"a\"},\n    {\"n\":2,\"text\":\"b\"}\n  ],\n  "
            "\"cut\": 2\n}\n");
}

TEST(ReportStreamTest, ATableShowsEarlyAndLateFactsAtItsEnd) {
  std::ostringstream out;
  ReportStream stream(out, Format::kTable, {.rows_name = "rows", .keys = {}});
  stream.begin({{"tick", 1}});
  stream.add(row(1, "a"));
  stream.end({{"cut", 2}});
  EXPECT_EQ(out.str(), "n  text\n1  a\ntick 1, cut 2\n");
}

TEST(ReportStreamTest, ATableHoldsBackAtMostWidthRows) {
  std::ostringstream out;
  ReportStream stream(out, Format::kTable, {.rows_name = "rows", .keys = {}, .width_rows = 2});
  stream.begin(Json::object());
  stream.add(row(1, "a"));
  EXPECT_EQ(out.str(), "");
  stream.add(row(222, "b"));
  EXPECT_EQ(out.str(), "n    text\n1    a\n222  b\n");
  stream.add(row(44444, "c"));
  EXPECT_EQ(out.str(), "n    text\n1    a\n222  b\n44444  c\n") << "wider than the rows that set the widths";
  stream.end();
}

TEST(ReportStreamTest, EachFormatHasAFormWithoutRows) {
  const auto empty = [](Format format) {
    std::ostringstream out;
    ReportStream stream(out, format, {.rows_name = "found", .keys = {"ball", "id"}});
    stream.begin(Json::object());
    stream.end();
    return out.str();
  };
  EXPECT_EQ(empty(Format::kTable), "nothing\n");
  EXPECT_EQ(empty(Format::kJson), "{\n  \"found\": []\n}\n");
  EXPECT_EQ(empty(Format::kNdjson), "");
  EXPECT_EQ(empty(Format::kCsv), "ball,id\n");
}

}  // namespace
}  // namespace locus::cli
