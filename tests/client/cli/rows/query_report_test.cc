#include "client/cli/rows/query_report.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

// A new result column of the protocol fails this test until the command line prints it.
TEST(QueryReportTest, EveryColumnHasKeysInTheRows) {
  v1::BlockResult block;
  block.add_counts(1);
  block.add_ids(7);
  for (int column = v1::Column_MIN; column <= v1::Column_MAX; ++column) {
    if (!v1::Column_IsValid(column) || column == v1::COLUMN_UNSPECIFIED) continue;
    RowLayout layout;
    layout.columns = {static_cast<v1::Column>(column)};
    const std::vector<std::string> keys = row_keys(layout);
    ASSERT_FALSE(keys.empty()) << v1::Column_Name(static_cast<v1::Column>(column));
    const absl::StatusOr<std::vector<Json>> rows = rows_json(block, layout);
    ASSERT_TRUE(rows.ok()) << rows.status();
    ASSERT_EQ(rows->size(), 1u);
    for (const std::string& key : keys) EXPECT_TRUE(rows->front().contains(key)) << key;
  }
}

}  // namespace
}  // namespace locus::cli
