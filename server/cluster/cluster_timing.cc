#include "server/cluster/cluster_timing.h"

#include <ctime>

#include "core/base/check.h"

namespace locus::server {

void ClusterTiming::check() const {
  LOCUS_CHECK(lease < silence);
  LOCUS_CHECK(beat + jitter < lease);
  LOCUS_CHECK(beat + jitter < max_gap);
  LOCUS_CHECK(quiet <= silence);
  LOCUS_CHECK(retry > Duration::zero());
}

ClusterTime time_since_boot() {
  timespec now = {};
  LOCUS_CHECK_EQ(clock_gettime(CLOCK_BOOTTIME, &now), 0);
  return ClusterTime(std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec));
}

}  // namespace locus::server
