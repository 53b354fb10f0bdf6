#include "tests/bench/frame/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace locus::bench {
namespace {

using ::testing::HasSubstr;

Report report_of_one() {
  Report report;
  report.cells.push_back({"static", "build/delta", "ns/triangle", 100, 150, "embree_medium", 1.5, 0.1, "00ff"});
  report.notes.emplace_back("a peer is missing");
  return report;
}

TEST(ReportTest, JsonIsAListOfCellsWithEveryField) {
  const nlohmann::json list = nlohmann::json::parse(json_of(report_of_one()));
  const nlohmann::json expected = {{{"suite", "static"},
                                    {"case", "build/delta"},
                                    {"metric", "ns/triangle"},
                                    {"ours", 100.0},
                                    {"peer", 150.0},
                                    {"peer_name", "embree_medium"},
                                    {"ratio", 1.5},
                                    {"spread", 0.1},
                                    {"results_hash", "00ff"}}};
  EXPECT_EQ(list, expected);
}

TEST(ReportTest, TheListenerIsCalledForEachCellAtOnce) {
  Report report;
  std::ostringstream out;
  report.on_cell = [&](const Cell& cell) { write_row(cell, out); };
  report.add(report_of_one().cells.front());
  EXPECT_THAT(out.str(), HasSubstr("build/delta"));
  EXPECT_EQ(report.cells.size(), 1u);
}

TEST(ReportTest, TheTableEndsWithNotesAndDisagreements) {
  Report report = report_of_one();
  report.disagreements.emplace_back("we are wrong");
  std::ostringstream out;
  write_closing(report, out);
  EXPECT_THAT(out.str(), HasSubstr("note: a peer is missing"));
  EXPECT_THAT(out.str(), HasSubstr("DISAGREEMENT: we are wrong"));
}

TEST(ReportTest, OneDisagreementMakesTheExitStatusOne) {
  Report report = report_of_one();
  EXPECT_EQ(exit_status(report), 0);
  report.disagreements.emplace_back("we are wrong");
  EXPECT_EQ(exit_status(report), 1);
}

TEST(ReportTest, JsonThatCannotBeWrittenIsAnError) {
  const absl::Status status = write_json(report_of_one(), "/no/such/folder/cells.json");
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("cannot write /no/such/folder/cells.json"));
}

TEST(ReportTest, JsonIsWrittenToTheFile) {
  const std::string path = testing::TempDir() + "/cells.json";
  ASSERT_TRUE(write_json(report_of_one(), path).ok());
  std::ifstream file(path);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  EXPECT_EQ(text, json_of(report_of_one()));
}

}  // namespace
}  // namespace locus::bench
