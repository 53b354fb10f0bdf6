#include "server/scheduling/batch_priority.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

namespace locus::server {
namespace {

int nice_of_this_thread() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(BatchPriorityTest, NiceIsTheThreadsOwn) {
  const int before = nice_of_this_thread();
  int there = 0;
  std::thread([&there] {
    take_priority(BatchPriority::kNice);
    there = nice_of_this_thread();
  }).join();
  EXPECT_EQ(there, std::min(before + 10, 19));
  EXPECT_EQ(nice_of_this_thread(), before);
}

TEST(BatchPriorityTest, IdleThreadsRunWhenNobodyElseDoes) {
  int policy = 0;
  std::thread([&policy] {
    take_priority(BatchPriority::kIdle);
    policy = sched_getscheduler(0);
  }).join();
  EXPECT_EQ(policy, SCHED_IDLE);
}

}  // namespace
}  // namespace locus::server
