#include "tests/bench/plot/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace locus::bench {
namespace {

using ::testing::HasSubstr;

Record small_record() {
  return {.date = "2026-01-31",
          .machine = "some processor, 2 cores",
          .arguments = "static --quick",
          .cells = {{"static", "build/delta", "ns/triangle", 100, 150, "embree_medium", 1.5, 0.1, "00ff"}}};
}

std::string record_file(const std::string& text) {
  const std::string path = testing::TempDir() + "/record.json";
  std::ofstream(path) << text;
  return path;
}

TEST(RecordTest, AWrittenRecordIsReadAgain) {
  const std::string path = testing::TempDir() + "/written.json";
  ASSERT_TRUE(write_record(small_record(), path).ok());
  const absl::StatusOr<Record> read = read_record(path);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(json_of(*read), json_of(small_record()));
  EXPECT_EQ(read->machine, "some processor, 2 cores");
  EXPECT_EQ(read->cells.front().peer_name, "embree_medium");
}

TEST(RecordTest, FilesThatAreNoRecordsAreRefusedWithTheirNames) {
  EXPECT_EQ(read_record("/no/such/record.json").status().code(), absl::StatusCode::kNotFound);
  Record two = small_record();
  two.cells.push_back(two.cells.front());
  two.cells.back().suite = "dynamic";
  Record none = small_record();
  none.cells.clear();
  for (const std::string& text :
       {std::string("["), std::string("[]"), std::string("{\"date\": 3}"), json_of(two), json_of(none)}) {
    const absl::Status status = read_record(record_file(text)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("record.json")) << text;
  }
}

TEST(RecordTest, RecordedArgumentsDoNotSayWhereOutputGoes) {
  EXPECT_EQ(
      recorded_arguments({"static", "--json", "a.json", "--quick", "--plot=plots", "--plot", "plots", "--rounds", "9"}),
      "static --quick --rounds 9");
}

TEST(RecordTest, TheDateAndTheMachineAreKnown) {
  EXPECT_THAT(date_of_today(), ::testing::MatchesRegex("2[0-9][0-9][0-9]-[0-9][0-9]-[0-9][0-9]"));
  EXPECT_THAT(name_of_machine(), ::testing::MatchesRegex(".+, [0-9]+ cores?"));
}

}  // namespace
}  // namespace locus::bench
