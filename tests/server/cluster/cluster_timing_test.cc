#include "server/cluster/cluster_timing.h"

#include <gmock/gmock.h>

namespace locus::server {
namespace {

using std::chrono::seconds;

TEST(ClusterTimingTest, TheDefaultsAgree) { ClusterTiming().check(); }

TEST(ClusterTimingDeathTest, ALeaseEndsBeforeAMemberCanBeDeclaredDead) {
  ClusterTiming timing;
  timing.lease = timing.silence;
  EXPECT_DEATH(timing.check(), "lease < silence");
}

TEST(ClusterTimingDeathTest, ABeatIsDueBeforeTheLeaseEnds) {
  ClusterTiming timing;
  timing.beat = seconds(5);
  EXPECT_DEATH(timing.check(), "beat");
}

TEST(ClusterTimingTest, TheTimeSinceBootAdvances) {
  const ClusterTime first = time_since_boot();
  EXPECT_GE(time_since_boot(), first);
  EXPECT_GT(first, ClusterTime());
}

}  // namespace
}  // namespace locus::server
