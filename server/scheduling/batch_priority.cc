#include "server/scheduling/batch_priority.h"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

namespace locus::server {
namespace {

constexpr int kSteps = 10;
constexpr int kLowest = 19;

}  // namespace

void take_priority(BatchPriority priority) {
  if (priority == BatchPriority::kIdle) {
    const sched_param parameter{};
    sched_setscheduler(0, SCHED_IDLE, &parameter);
    return;
  }
  // Linux keeps niceness thread by thread.
  const auto self = static_cast<id_t>(gettid());
  setpriority(PRIO_PROCESS, self, std::min(getpriority(PRIO_PROCESS, self) + kSteps, kLowest));
}

}  // namespace locus::server
