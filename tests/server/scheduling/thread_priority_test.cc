#include "server/scheduling/thread_priority.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

namespace locus::server {
namespace {

int nice_of_this_thread() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

// Returns the time slice of this thread in nanoseconds; 0 if Linux is too old to report it.
uint64_t slice_of_this_thread() {
  struct {
    uint32_t size, policy;
    uint64_t flags;
    int32_t nice;
    uint32_t priority;
    uint64_t slice, deadline, period;
  } attributes = {};
  EXPECT_EQ(syscall(SYS_sched_getattr, 0, &attributes, sizeof(attributes), 0), 0);
  return attributes.slice;
}

TEST(ThreadPriorityTest, SlicesAreShortIfLinuxReportsThem) {
  uint64_t usual = 0, of_batches = 0, asked = 0;
  std::thread([&] {
    usual = slice_of_this_thread();
    take_short_slices();
    asked = slice_of_this_thread();
  }).join();
  std::thread([&] {
    take_batch_priority(BatchPriority::kNice);
    of_batches = slice_of_this_thread();
  }).join();
  const uint64_t wanted = usual == 0 ? 0 : 100'000;
  EXPECT_EQ(asked, wanted);
  EXPECT_EQ(of_batches, wanted);
}

TEST(ThreadPriorityTest, NicenessIsSetForOneThread) {
  const int before = nice_of_this_thread();
  int there = 0;
  std::thread([&there] {
    take_batch_priority(BatchPriority::kNice);
    there = nice_of_this_thread();
  }).join();
  EXPECT_EQ(there, std::min(before + 10, 19));
  EXPECT_EQ(nice_of_this_thread(), before);
}

TEST(ThreadPriorityTest, ShortSlicesLeaveNicenessAndPolicyAsTheyWere) {
  int nice = 0, policy = -1;
  std::thread([&] {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 7);
    take_short_slices();
    nice = nice_of_this_thread();
    policy = sched_getscheduler(0);
  }).join();
  EXPECT_EQ(nice, 7);
  EXPECT_EQ(policy, SCHED_OTHER);
}

TEST(ThreadPriorityTest, IdlePrioritySetsTheIdlePolicyOfTheThread) {
  int policy = 0;
  std::thread([&policy] {
    take_batch_priority(BatchPriority::kIdle);
    policy = sched_getscheduler(0);
  }).join();
  EXPECT_EQ(policy, SCHED_IDLE);
}

}  // namespace
}  // namespace locus::server
