#include "server/scheduling/thread_priority.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

namespace locus::server {
namespace {

int nice_of_this_thread() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(ThreadPriorityTest, NiceIsTheThreadsOwn) {
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

TEST(ThreadPriorityTest, IdleThreadsRunWhenNobodyElseDoes) {
  int policy = 0;
  std::thread([&policy] {
    take_batch_priority(BatchPriority::kIdle);
    policy = sched_getscheduler(0);
  }).join();
  EXPECT_EQ(policy, SCHED_IDLE);
}

}  // namespace
}  // namespace locus::server
