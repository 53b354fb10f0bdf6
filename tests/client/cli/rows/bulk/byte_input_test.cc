#include "client/cli/rows/bulk/byte_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "tests/client/cli/rows/bulk/test_input.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

TEST(ByteInputTest, AFileIsReadToItsEndAndThenReadReturnsZero) {
  const TestFile file("abc");
  absl::StatusOr<ByteInput> input = ByteInput::open(file.path());
  ASSERT_TRUE(input.ok());
  std::array<char, 2> buffer{};
  EXPECT_EQ(*input->read(absl::MakeSpan(buffer)), 2u);
  EXPECT_EQ(*input->read(absl::MakeSpan(buffer)), 1u);
  EXPECT_EQ(buffer[0], 'c');
  EXPECT_TRUE(input->ready_within(std::chrono::milliseconds(0))) << "the end is ready";
  EXPECT_EQ(*input->read(absl::MakeSpan(buffer)), 0u);
}

TEST(ByteInputTest, AMissingFileIsNotFound) {
  const absl::StatusOr<ByteInput> input = ByteInput::open("/nonexistent/rows.csv");
  EXPECT_TRUE(absl::IsNotFound(input.status()));
  EXPECT_THAT(std::string(input.status().message()), HasSubstr("no file /nonexistent/rows.csv: check the path"));
}

TEST(ByteInputTest, AFolderIsRefused) {
  const absl::StatusOr<ByteInput> input = ByteInput::open("/");
  EXPECT_TRUE(absl::IsInvalidArgument(input.status()));
  EXPECT_THAT(std::string(input.status().message()), HasSubstr("/ is a folder: give a file"));
}

TEST(ByteInputTest, StandardInputIsNamedStdin) { EXPECT_EQ(ByteInput::open("-")->name(), "stdin"); }

}  // namespace
}  // namespace locus::cli
