#include "client/cli/rows/bulk/row_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>

#include "tests/client/cli/rows/bulk/test_input.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;

RowSchema target_schema() { return {{.name = "to", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true}}; }

RowReader reader_of(const std::string& path, RowFormat format = RowFormat::kCsv) {
  absl::StatusOr<ByteInput> input = ByteInput::open(path);
  EXPECT_TRUE(input.ok()) << input.status();
  return RowReader(*std::move(input), format, target_schema());
}

TEST(RowReaderTest, BatchesHaveTheLinesAndIndicesOfTheirRows) {
  const TestFile file("\xEF\xBB\xBFto.x,to.y,to.z\r\n1,2,3\r\n\r\n4,5,6\r\n7,8,\"9\n\"\r\n");
  RowReader reader = reader_of(file.path());
  RowBatch batch;
  ASSERT_EQ(*reader.next(2, Patience::kWait, batch), BatchEnd::kFull);
  EXPECT_THAT(batch.columns[0].numbers, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(batch.lines, ElementsAre(2, 4));
  const absl::StatusOr<BatchEnd> end = reader.next(2, Patience::kWait, batch);
  EXPECT_EQ(end.status().message(), file.path() + ":5: to.z: '9\\n' is no number");
  EXPECT_EQ(batch.first_row, 2u);
}

TEST(RowReaderTest, TheLastBatchMayBeShorter) {
  const TestFile file("to.x,to.y,to.z\n1,2,3\n4,5,6");
  RowReader reader = reader_of(file.path());
  RowBatch batch;
  EXPECT_EQ(*reader.next(10, Patience::kWait, batch), BatchEnd::kEnd);
  EXPECT_EQ(batch.rows(), 2u);
}

TEST(RowReaderTest, AnEmptyCsvLacksItsHeaderAndAHeaderAloneHasNoRows) {
  const TestFile empty("\n \n", "empty.csv");
  RowReader none = reader_of(empty.path());
  RowBatch batch;
  EXPECT_THAT(std::string(none.next(10, Patience::kWait, batch).status().message()),
              EndsWith("is empty; the first line names the columns, out of: to.x, to.y, to.z"));
  const TestFile header("to.x,to.y,to.z\n");
  RowReader reader = reader_of(header.path());
  EXPECT_EQ(*reader.next(10, Patience::kWait, batch), BatchEnd::kEnd);
  EXPECT_EQ(batch.rows(), 0u);
}

TEST(RowReaderTest, AnEmptyNdjsonHasNoRows) {
  const TestFile file("", "rows.ndjson");
  RowReader reader = reader_of(file.path(), RowFormat::kNdjson);
  RowBatch batch;
  EXPECT_EQ(*reader.next(10, Patience::kWait, batch), BatchEnd::kEnd);
}

TEST(RowReaderTest, AWrongLineOfJsonIsReportedWithFileAndLine) {
  const TestFile file("{\"to\":[1,2,3]}\n\n{\"to\":[1,2]}\n", "rows.ndjson");
  RowReader reader = reader_of(file.path(), RowFormat::kNdjson);
  RowBatch batch;
  EXPECT_EQ(reader.next(10, Patience::kWait, batch).status().message(), file.path() + ":3: to: has 2 numbers, not 3");
}

TEST(RowReaderTest, AnInputWithoutDataEndsABatchEarlyAndContinuesLater) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  RowReader reader = reader_of("/proc/self/fd/" + std::to_string(ends[0]), RowFormat::kNdjson);
  RowBatch batch;
  ASSERT_EQ(write(ends[1], "{\"to\":[1,2,3]}\n{\"to\"", 20), 20);
  ASSERT_EQ(*reader.next(10, Patience::kWait, batch), BatchEnd::kPause);
  EXPECT_EQ(batch.rows(), 1u);
  ASSERT_EQ(*reader.next(10, Patience::kPause, batch), BatchEnd::kPause);
  EXPECT_EQ(batch.rows(), 0u);
  ASSERT_EQ(write(ends[1], ":[4,5,6]}", 9), 9);
  close(ends[1]);
  close(ends[0]);
  ASSERT_EQ(*reader.next(10, Patience::kWait, batch), BatchEnd::kEnd);
  EXPECT_THAT(batch.columns[0].numbers, ElementsAre(4, 5, 6));
  EXPECT_EQ(batch.first_row, 1u);
  EXPECT_THAT(batch.lines, ElementsAre(2));
}

}  // namespace
}  // namespace locus::cli
