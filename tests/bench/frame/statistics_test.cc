#include "tests/bench/frame/statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::bench {
namespace {

using ::testing::ElementsAre;

TEST(StatisticsTest, MedianOfAnOddCountIsTheMiddleValue) { EXPECT_EQ(median({5, 1, 9}), 5); }

TEST(StatisticsTest, MedianOfAnEvenCountIsTheMeanOfTheMiddleTwo) { EXPECT_EQ(median({4, 1, 2, 100}), 3); }

TEST(StatisticsTest, APercentileIsTheSmallestValueThatTheShareDoesNotExceed) {
  EXPECT_EQ(percentile({4, 1, 3, 2}, 0.5), 2);
  EXPECT_EQ(percentile({4, 1, 3, 2}, 0.51), 3);
  EXPECT_EQ(percentile({4, 1, 3, 2}, 0.99), 4);
  EXPECT_EQ(percentile({4, 1, 3, 2}, 0), 1);
}

TEST(StatisticsTest, SpreadIsTheRangeOverTheMedian) { EXPECT_EQ(spread({2, 4, 3, 5, 4}), 0.75); }

TEST(StatisticsTest, EqualValuesHaveNoSpread) { EXPECT_EQ(spread({7, 7, 7}), 0); }

TEST(StatisticsTest, RatiosAreTakenRoundByRound) {
  EXPECT_THAT(round_ratios({1, 2, 4}, {2, 2, 1}), ElementsAre(2, 1, 0.25));
}

}  // namespace
}  // namespace locus::bench
