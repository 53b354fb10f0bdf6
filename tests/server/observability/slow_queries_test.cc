#include "server/observability/slow_queries.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "server/config/observability_limits.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr SlowQueries::Time kStart = SlowQueries::Time(std::chrono::hours(1));

SlowQuery query() {
  SlowQuery slow;
  slow.rpc = "Query";
  slow.scene = "arena";
  slow.kinds = "ray,ball";
  slow.revision = 12;
  slow.queries = 8192;
  slow.nanoseconds = 1'234'567'890;
  slow.work_nanoseconds = 2'000'000'000;
  slow.work = {.nodes = 7, .cells = 8, .tests = 9};
  return slow;
}

std::string lines_of(SlowQueries& queries, int times, SlowQueries::Time now) {
  testing::internal::CaptureStderr();
  for (int i = 0; i < times; ++i) queries.record(query(), now);
  return testing::internal::GetCapturedStderr();
}

size_t count_lines(const std::string& text) { return static_cast<size_t>(std::count(text.begin(), text.end(), '\n')); }

TEST(SlowQueriesTest, ABatchThatTakesTheThresholdIsSlow) {
  const SlowQueries queries(2);
  EXPECT_FALSE(queries.is_slow(1'999'999));
  EXPECT_TRUE(queries.is_slow(2'000'000));
}

TEST(SlowQueriesTest, WithoutAThresholdNothingIsSlow) { EXPECT_FALSE(SlowQueries(0).is_slow(uint64_t{1} << 62)); }

TEST(SlowQueriesTest, TheLineDescribesTheSlowBatch) {
  SlowQueries queries(1);
  const std::string line = lines_of(queries, 1, kStart);
  EXPECT_THAT(line, HasSubstr("slow queries rpc=Query scene=arena revision=12 kinds=ray,ball queries=8192 ms=1234 "
                              "work_ms=2000 nodes=7 cells=8 tests=9 left_out=0"));
  EXPECT_EQ(queries.count(), 1u);
}

TEST(SlowQueriesTest, AtMostTheMaximumIsLoggedASecondAndAllAreCounted) {
  SlowQueries queries(1);
  EXPECT_EQ(count_lines(lines_of(queries, 50, kStart)), kMaxSlowQueryLines);
  EXPECT_EQ(count_lines(lines_of(queries, 5, kStart + milliseconds(999))), 0u);
  const std::string later = lines_of(queries, 2, kStart + milliseconds(1000));
  EXPECT_EQ(count_lines(later), 2u);
  EXPECT_THAT(later, HasSubstr("left_out=45\n"));
  EXPECT_THAT(later, HasSubstr("left_out=0\n"));
  EXPECT_EQ(queries.count(), 57u);
}

}  // namespace
}  // namespace locus::server
