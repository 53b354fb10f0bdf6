#include "client/cli/rows/bulk/sent_rows.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

const SentRows kSent = {.first_row = 100, .lines = {5, 6, 8, 9}, .list_starts = {0, 3}};

TEST(SentRowsTest, AnItemIsFoundByItsListAndIndex) {
  EXPECT_EQ(kSent.line_of("moves[0].ids", 2), 8u);
  EXPECT_EQ(kSent.line_of("blocks[1].rays.directions", 0), 9u);
  EXPECT_EQ(kSent.line_of("remove_ids", 1), 6u);
}

TEST(SentRowsTest, FieldsAndIndicesWithoutARowAreNotFound) {
  EXPECT_FALSE(kSent.line_of("moves[0].ids", 3).has_value()) << "beyond its list";
  EXPECT_FALSE(kSent.line_of("moves[1].ids", 1).has_value()) << "beyond the last list";
  EXPECT_FALSE(kSent.line_of("moves[2].ids", 0).has_value());
  EXPECT_FALSE(kSent.line_of("moves[x].ids", 0).has_value());
  EXPECT_FALSE(kSent.line_of("moves[", 0).has_value());
  EXPECT_FALSE(SentRows{}.line_of("remove_ids", 0).has_value());
}

TEST(SentRowsTest, TheLineRangeIsOneLineOrTwo) {
  EXPECT_EQ(kSent.line_range(), "5-9");
  EXPECT_EQ((SentRows{.lines = {7}, .list_starts = {0}}).line_range(), "7");
  EXPECT_EQ(SentRows{}.line_range(), "");
}

}  // namespace
}  // namespace locus::cli
