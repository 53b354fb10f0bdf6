#include "tests/bench/frame/case_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::bench {
namespace {

using ::testing::HasSubstr;

TEST(CaseFilterTest, WithoutAPatternEveryCaseIsSelected) {
  EXPECT_TRUE(CaseFilter().wants("ray/short/any/delta"));
  EXPECT_TRUE(CaseFilter().wants_every());
}

TEST(CaseFilterTest, APatternMatchesAnywhereInTheName) {
  const auto filter = CaseFilter::create("short/(any|all)");
  ASSERT_TRUE(filter.ok());
  EXPECT_TRUE(filter->wants("ray/short/any/delta"));
  EXPECT_FALSE(filter->wants("ray/short/first/delta"));
  EXPECT_FALSE(filter->wants_every());
}

TEST(CaseFilterTest, AnEmptyPatternSelectsEveryCase) {
  const auto filter = CaseFilter::create("");
  ASSERT_TRUE(filter.ok());
  EXPECT_TRUE(filter->wants("build/delta"));
  EXPECT_TRUE(filter->wants_every());
}

TEST(CaseFilterTest, AnInvalidPatternIsRefusedWithAReason) {
  const auto filter = CaseFilter::create("ray/(");
  EXPECT_EQ(filter.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(filter.status().message()), HasSubstr("`ray/(` is no regular expression"));
}

}  // namespace
}  // namespace locus::bench
