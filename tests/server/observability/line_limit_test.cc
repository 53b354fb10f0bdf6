#include "server/observability/line_limit.h"

#include <gtest/gtest.h>

namespace locus::server {
namespace {

using std::chrono::milliseconds;

TEST(LineLimitTest, LinesBeyondTheLimitAreLeftOutAndCountedByTheNextLine) {
  LineLimit limit(2);
  const LineLimit::Time start{std::chrono::hours(1)};
  EXPECT_EQ(limit.admit(start), 0u);
  EXPECT_EQ(limit.admit(start + milliseconds(1)), 0u);
  EXPECT_EQ(limit.admit(start + milliseconds(2)), std::nullopt);
  EXPECT_EQ(limit.admit(start + milliseconds(999)), std::nullopt);
  EXPECT_EQ(limit.admit(start + milliseconds(1000)), 2u);
  EXPECT_EQ(limit.admit(start + milliseconds(1001)), 0u);
  EXPECT_EQ(limit.admit(start + milliseconds(1002)), std::nullopt);
}

}  // namespace
}  // namespace locus::server
