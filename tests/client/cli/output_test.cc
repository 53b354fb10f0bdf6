#include "client/cli/output.h"

#include <gtest/gtest.h>

#include <limits>
#include <sstream>

namespace locus::cli {
namespace {

Report two_rows() {
  Report report;
  report.head = {{"revision", 12}, {"tick", 3}};
  report.rows_name = "hits";
  report.rows.push_back({{"ray", 0}, {"hit", true}, {"id", id_json(7)}, {"point", floats_json({0.5f, 1.0f, -2.0f})}});
  report.rows.push_back({{"ray", 1}, {"hit", false}, {"id", nullptr}, {"point", nullptr}});
  return report;
}

std::string written(Format format, const Report& report) {
  std::ostringstream out;
  write_report(out, format, report);
  return out.str();
}

TEST(OutputTest, ATableAlignsRowsUnderTheirKeysAndEndsWithTheHead) {
  EXPECT_EQ(written(Format::kTable, two_rows()),
            "ray  hit  id  point\n"
            "0    yes  7   0.5,1.0,-2.0\n"
            "1    no   -   -\n"
            "revision 12, tick 3\n");
}

TEST(OutputTest, JsonIsOneDocumentWithIdsAsStrings) {
  const Json document = Json::parse(written(Format::kJson, two_rows()));
  EXPECT_EQ(document["revision"], 12);
  EXPECT_EQ(document["hits"][0]["id"], "7");
  EXPECT_EQ(document["hits"][0]["point"], Json::parse("[0.5, 1.0, -2.0]"));
  EXPECT_TRUE(document["hits"][1]["id"].is_null());
}

TEST(OutputTest, JsonWritesEachRowOnOneLine) {
  Report report;
  report.head = {{"tick", 3}};
  report.rows_name = "hits";
  report.rows = {{{"point", {1, 2}}}, {{"point", {3, 4}}}};
  EXPECT_EQ(written(Format::kJson, report),
            "{\n  \"tick\": 3,\n  \"hits\": [\n    {\"point\":[1,2]},\n    {\"point\":[3,4]}\n  ]\n}\n");
}

TEST(OutputTest, NdjsonIsOneLinePerRow) {
  EXPECT_EQ(written(Format::kNdjson, two_rows()),
            "{\"ray\":0,\"hit\":true,\"id\":\"7\",\"point\":[0.5,1.0,-2.0]}\n"
            "{\"ray\":1,\"hit\":false,\"id\":null,\"point\":null}\n");
}

TEST(OutputTest, WithoutRowsATableHasATextAndJsonAnEmptyList) {
  Report report;
  report.rows_name = "scenes";
  report.no_rows = "no scenes";
  EXPECT_EQ(written(Format::kTable, report), "no scenes\n");
  EXPECT_TRUE(Json::parse(written(Format::kJson, report))["scenes"].empty());
  EXPECT_EQ(written(Format::kNdjson, report), "");
}

TEST(OutputTest, AReportWithoutRowsIsItsHead) {
  Report report;
  report.head = {{"name", "arena"}, {"min", nullptr}};
  EXPECT_EQ(written(Format::kTable, report), "name  arena\nmin   -\n");
  EXPECT_EQ(written(Format::kNdjson, report), "{\"name\":\"arena\",\"min\":null}\n");
}

TEST(OutputTest, CsvIsAHeaderAndOneLinePerRowWithVectorsSplitAndNullEmpty) {
  EXPECT_EQ(written(Format::kCsv, two_rows()),
            "ray,hit,id,point.x,point.y,point.z\n"
            "0,true,7,0.5,1.0,-2.0\n"
            "1,false,,,,\n");
}

TEST(OutputTest, CsvHasTheKeysOfEveryRow) {
  Report report;
  report.rows_name = "things";
  report.rows = {{{"id", "1"}}, {{"id", "2"}, {"radius", 0.5}}};
  EXPECT_EQ(written(Format::kCsv, report), "id,radius\n1,\n2,0.5\n");
}

TEST(OutputTest, CsvWithoutRowsIsTheHeaderOfTheGivenKeys) {
  Report report;
  report.rows_name = "found";
  report.keys = {"ball", "id"};
  EXPECT_EQ(written(Format::kCsv, report), "ball,id\n");
}

TEST(OutputTest, CsvOfAReportWithoutRowsIsOneHeaderAndOneLine) {
  Report report;
  report.head = {{"name", "arena"}, {"min", nullptr}, {"features", {"rays", "balls"}}};
  EXPECT_EQ(written(Format::kCsv, report),
            "name,min.x,min.y,min.z,features\narena,,,,\"[\"\"rays\"\",\"\"balls\"\"]\"\n");
}

TEST(OutputTest, GivenKeysAreAlsoTheColumnsOfATable) {
  Report report;
  report.rows_name = "things";
  report.keys = {"id", "radius"};
  report.rows = {{{"id", "1"}}, {{"id", "2"}, {"radius", 0.5}}};
  EXPECT_EQ(written(Format::kTable, report), "id  radius\n1   -\n2   0.5\n");
}

TEST(OutputTest, IdsKeepAll64Bits) { EXPECT_EQ(id_json(0xFFFFFFFFFFFFFFFFull), "18446744073709551615"); }

TEST(OutputTest, FloatsPrintTheShortestDecimalAndInfinityIsNull) {
  EXPECT_EQ(float_json(0.1f).dump(), "0.1");
  EXPECT_EQ(float_json(16777216.0f).dump(), "16777216.0");
  EXPECT_TRUE(float_json(std::numeric_limits<float>::infinity()).is_null());
  EXPECT_TRUE(float_json(std::numeric_limits<float>::quiet_NaN()).is_null());
}

TEST(OutputTest, TextThatIsNotUtf8IsReplacedInsteadOfFailing) {
  Report report;
  report.head = {{"name", std::string("\xff", 1)}};
  EXPECT_NE(written(Format::kJson, report).find("\xEF\xBF\xBD"), std::string::npos);
}

}  // namespace
}  // namespace locus::cli
