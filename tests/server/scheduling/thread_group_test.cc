#include "server/scheduling/thread_group.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

namespace locus::server {
namespace {

TEST(ThreadGroupTest, OneMoreThanMayRunIsRefusedAndNotRun) {
  ThreadGroup group(2);
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  ASSERT_TRUE(group.start([released] { released.wait(); }));
  ASSERT_TRUE(group.start([released] { released.wait(); }));
  std::atomic<bool> ran{false};
  EXPECT_FALSE(group.start([&ran] { ran = true; }));
  EXPECT_EQ(group.running(), 2u);
  release.set_value();
  group.join_all();
  EXPECT_EQ(group.running(), 0u);
  EXPECT_FALSE(ran.load());
}

TEST(ThreadGroupTest, AnEndedThreadMakesRoom) {
  ThreadGroup group(1);
  std::atomic<int> runs{0};
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(group.start([&runs] { ++runs; }));
    group.join_all();
  }
  EXPECT_EQ(runs.load(), 50);
}

TEST(ThreadGroupTest, TheDestructorWaitsForTasks) {
  std::atomic<int> runs{0};
  {
    ThreadGroup group(8);
    for (int i = 0; i < 8; ++i) ASSERT_TRUE(group.start([&runs] { ++runs; }));
  }
  EXPECT_EQ(runs.load(), 8);
}

}  // namespace
}  // namespace locus::server
