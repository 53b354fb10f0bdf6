#include "server/observability/latency_histogram.h"

#include <gtest/gtest.h>

namespace locus::server {
namespace {

TEST(LatencyHistogramTest, EveryDurationIsInTheLowestRangeWhoseBoundItDoesNotExceed) {
  for (size_t range = 0; range < kLatencyBounds; ++range) {
    const uint64_t bound = latency_bound(range);
    EXPECT_EQ(latency_range(bound), range);
    EXPECT_EQ(latency_range(bound + 1), range + 1);
  }
  EXPECT_EQ(latency_range(0), 0u);
  EXPECT_EQ(latency_range(1), 0u);
  EXPECT_EQ(latency_range(UINT64_MAX), kLatencyBounds);
}

TEST(LatencyHistogramTest, BoundsAscendByAtMostAHalf) {
  EXPECT_EQ(latency_bound(0), 1024u);
  for (size_t range = 1; range < kLatencyBounds; ++range) {
    EXPECT_GT(latency_bound(range), latency_bound(range - 1));
    EXPECT_LE(2 * latency_bound(range), 3 * latency_bound(range - 1));
  }
  EXPECT_EQ(latency_bound(kLatencyBounds - 1), uint64_t{1} << kHighestOctave);
}

TEST(LatencyHistogramTest, HistogramsAddUp) {
  LatencyHistogram first;
  LatencyHistogram second;
  first.record(1000);
  first.record(5'000'000);
  second.record(1000);
  second.record(uint64_t{1} << 40);
  LatencyCounts counts;
  first.add_to(counts);
  second.add_to(counts);
  EXPECT_EQ(counts.count(), 4u);
  EXPECT_EQ(counts.nanoseconds, 5'002'000u + (uint64_t{1} << 40));
  EXPECT_EQ(counts.ranges[0], 2u);
  EXPECT_EQ(counts.ranges[latency_range(5'000'000)], 1u);
  EXPECT_EQ(counts.ranges[kLatencyBounds], 1u);
}

}  // namespace
}  // namespace locus::server
