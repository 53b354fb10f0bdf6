#include "client/cli/commands/bulk_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(BulkOptionsTest, AColumnWithoutAnyValueIsReplacedByTheOptionsValue) {
  const RowColumn column = {.numbers = {0, 0}, .integers = {0, 0}, .given = {0, 0}};
  EXPECT_THAT(float_column(column, {0, 2}, {7}, {5}), ElementsAre(5));
  EXPECT_THAT(id_column(column, {0, 2}, 7, {}), IsEmpty());
  EXPECT_THAT(bits_column(column, {0, 2}, 7, {3}), ElementsAre(3));
}

TEST(BulkOptionsTest, ARowWithoutAValueGetsTheDefault) {
  const RowColumn column = {.numbers = {1, 2, 0, 0, 3, 4}, .integers = {1, 0, 3}, .given = {1, 0, 1}};
  EXPECT_THAT(float_column(column, {0, 3}, {8, 9}, {}), ElementsAre(1, 2, 8, 9, 3, 4));
  EXPECT_THAT(id_column(column, {1, 3}, 7, {}), ElementsAre(7, 3));
  EXPECT_THAT(bits_column(column, {1, 2}, 0xFFFFFFFFu, {}), ElementsAre(0xFFFFFFFFu));
}

TEST(BulkOptionsTest, InWordsKeepsCodeAndPayloads) {
  absl::Status status = absl::NotFoundError("old");
  status.SetPayload("type", absl::Cord("payload"));
  const absl::Status changed = in_words(status, "new");
  EXPECT_EQ(changed.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(changed.message(), "new");
  EXPECT_TRUE(changed.GetPayload("type").has_value());
}

}  // namespace
}  // namespace locus::cli
