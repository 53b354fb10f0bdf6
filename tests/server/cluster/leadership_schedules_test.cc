// Random schedules of a simulated cluster (tests/support/cluster_schedule.h): pauses, partitions, an engine that is
// away, kills, restarts, drains and moves, with calls that are lost, late or never executed.
#include <gmock/gmock.h>

#include "server/cluster/leadership.h"
#include "tests/support/cluster_schedule.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

TEST(LeadershipSchedulesTest, NoScheduleBreaksARule) {
  for (uint64_t seed = 0; seed < test::scaled_count(4000); ++seed) ASSERT_EQ(test::run_cluster_schedule(seed), "");
}

}  // namespace
}  // namespace locus::server
