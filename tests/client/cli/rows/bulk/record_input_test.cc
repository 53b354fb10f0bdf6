#include "client/cli/rows/bulk/record_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "tests/client/cli/rows/bulk/test_input.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

using Records = std::vector<std::pair<std::string, uint64_t>>;  // text and line number of each record

struct Outcome {
  Records records;
  absl::Status status;
  uint64_t line = 0;
};

Outcome read(const std::string& bytes, RecordForm form) {
  const TestFile file(bytes);
  absl::StatusOr<ByteInput> input = ByteInput::open(file.path());
  EXPECT_TRUE(input.ok()) << input.status();
  RecordInput records(*std::move(input), form);
  Outcome outcome;
  while (true) {
    Record record;
    const absl::StatusOr<Arrival> arrival = records.next(record, std::nullopt);
    outcome.status = arrival.status();
    outcome.line = records.line();
    if (!arrival.ok() || *arrival == Arrival::kEnd) return outcome;
    outcome.records.emplace_back(std::string(record.text), record.line);
  }
}

TEST(RecordInputTest, LinesEndWithOrWithoutCarriageReturnAndTheLastNeedsNoEnd) {
  EXPECT_THAT(read("a\nb\r\n\nc", RecordForm::kLine).records,
              ElementsAre(Pair("a", 1), Pair("b", 2), Pair("", 3), Pair("c", 4)));
}

TEST(RecordInputTest, AnEmptyInputHasNoRecord) { EXPECT_THAT(read("", RecordForm::kCsv).records, IsEmpty()); }

TEST(RecordInputTest, AByteOrderMarkIsDroppedOnlyAtTheBeginning) {
  EXPECT_THAT(read("\xEF\xBB\xBFx\n\xEF\xBB\xBFy\n", RecordForm::kLine).records,
              ElementsAre(Pair("x", 1), Pair("\xEF\xBB\xBFy", 2)));
}

TEST(RecordInputTest, LineBreaksInQuotesBelongToACsvRecordAndCountAsLines) {
  EXPECT_THAT(read("a,\"1\n2\n\"\"3\"\nb\n", RecordForm::kCsv).records,
              ElementsAre(Pair("a,\"1\n2\n\"\"3\"", 1), Pair("b", 4)));
  EXPECT_THAT(read("a\"\nb\n", RecordForm::kLine).records, ElementsAre(Pair("a\"", 1), Pair("b", 2)))
      << "lines of JSON know no such thing";
}

TEST(RecordInputTest, RecordsAcrossChunksAreComplete) {
  std::string bytes;
  for (int i = 0; i < 20000; ++i)
    bytes += std::to_string(i) + ",\"" + std::string(static_cast<size_t>(i % 37), 'x') + "\"\n";
  const Outcome outcome = read(bytes, RecordForm::kCsv);
  ASSERT_EQ(outcome.records.size(), 20000u);
  for (size_t i = 0; i < outcome.records.size(); ++i) {
    ASSERT_EQ(outcome.records[i].first, std::to_string(i) + ",\"" + std::string(i % 37, 'x') + "\"");
    ASSERT_EQ(outcome.records[i].second, i + 1);
  }
}

TEST(RecordInputTest, ALineAsLongAsTheLimitIsAcceptedAndOneByteMoreIsRefused) {
  EXPECT_EQ(read(std::string(kMaxRecordBytes, 'x') + "\r\n", RecordForm::kLine).records.size(), 1u);
  const Outcome longer = read("a\n" + std::string(kMaxRecordBytes + 3, 'x') + "\n", RecordForm::kLine);
  EXPECT_THAT(std::string(longer.status.message()), HasSubstr("the line is longer than 65536 bytes"));
  EXPECT_EQ(longer.line, 2u);
}

TEST(RecordInputTest, AnUnclosedQuoteIsReportedWithItsLine) {
  const Outcome at_end = read("a\n\"b\nc\n", RecordForm::kCsv);
  EXPECT_THAT(std::string(at_end.status.message()), HasSubstr("a quote is opened and not closed"));
  EXPECT_EQ(at_end.line, 2u);
  const Outcome far = read("\"" + std::string(200000, '\n'), RecordForm::kCsv);
  EXPECT_THAT(std::string(far.status.message()), HasSubstr("not closed within 65536 bytes"));
}

TEST(RecordInputTest, AnInputWithoutDataPausesAndContinuesWithTheSameRecord) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  absl::StatusOr<ByteInput> input = ByteInput::open("/proc/self/fd/" + std::to_string(ends[0]));
  ASSERT_TRUE(input.ok()) << input.status();
  RecordInput records(*std::move(input), RecordForm::kLine);
  ASSERT_EQ(write(ends[1], "one\ntw", 6), 6);
  Record record;
  ASSERT_EQ(*records.next(record, RecordInput::Clock::now()), Arrival::kRecord);
  EXPECT_EQ(record.text, "one");
  EXPECT_EQ(*records.next(record, RecordInput::Clock::now()), Arrival::kPause);
  ASSERT_EQ(write(ends[1], "o\n", 2), 2);
  ASSERT_EQ(*records.next(record, std::nullopt), Arrival::kRecord);
  EXPECT_EQ(record.text, "two");
  EXPECT_EQ(record.line, 2u);
  close(ends[1]);
  close(ends[0]);
  EXPECT_EQ(*records.next(record, std::nullopt), Arrival::kEnd);
}

}  // namespace
}  // namespace locus::cli
