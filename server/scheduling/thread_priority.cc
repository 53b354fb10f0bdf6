#include "server/scheduling/thread_priority.h"

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

namespace locus::server {
namespace {

constexpr int kSteps = 10;
constexpr int kLowest = 19;
constexpr uint64_t kSliceNanoseconds = 100'000;

// Copy of Linux's struct sched_attr, which this C library does not declare.
struct SchedulingAttributes {
  uint32_t size;
  uint32_t policy;
  uint64_t flags;
  int32_t nice;
  uint32_t priority;
  uint64_t slice;
  uint64_t deadline;
  uint64_t period;
};

}  // namespace

void take_batch_priority(BatchPriority priority) {
  if (priority == BatchPriority::kIdle) {
    const sched_param parameter{};
    sched_setscheduler(0, SCHED_IDLE, &parameter);
    return;
  }
  // Niceness belongs to a thread on Linux, not to the process.
  const auto self = static_cast<id_t>(gettid());
  setpriority(PRIO_PROCESS, self, std::min(getpriority(PRIO_PROCESS, self) + kSteps, kLowest));
  take_short_slices();
}

void take_short_slices() {
  SchedulingAttributes attributes = {};
  if (syscall(SYS_sched_getattr, 0, &attributes, sizeof(attributes), 0) != 0) return;
  attributes.slice = kSliceNanoseconds;
  syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace locus::server
