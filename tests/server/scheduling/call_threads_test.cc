#include "server/scheduling/call_threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <vector>

#include "server/scheduling/semaphore.h"

namespace locus::server {
namespace {

TEST(CallThreadsTest, TasksRunAtOnceUpToTheMaximum) {
  CallThreads threads(3);
  Semaphore started, go, ended;
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(threads.run([&] {
      started.post();
      go.wait();
      ended.post();
    }));
    started.wait();
  }
  EXPECT_FALSE(threads.run([] { ADD_FAILURE() << "a fourth task ran"; }));
  for (int i = 0; i < 3; ++i) go.post();
  for (int i = 0; i < 3; ++i) ended.wait();
}

TEST(CallThreadsTest, TheDestructorWaitsForRunningTasks) {
  std::atomic<int> done{0};
  {
    CallThreads threads(8);
    for (int i = 0; i < 8; ++i) EXPECT_TRUE(threads.run([&] { done.fetch_add(1); }));
  }
  EXPECT_EQ(done.load(), 8);
}

TEST(CallThreadsTest, ThreadsAreReusedAndEndWhenTooManyAreIdle) {
  CallThreads threads(64);
  for (int round = 0; round < 50; ++round) {
    Semaphore ended;
    int tasks = 0;
    for (int i = 0; i < 40; ++i) tasks += threads.run([&] { ended.post(); });
    EXPECT_EQ(tasks, 40);
    for (int i = 0; i < tasks; ++i) ended.wait();
  }
}

TEST(CallThreadsTest, ManyThreadsMayStartTasksAtOnce) {
  std::atomic<int> ran{0}, accepted{0};
  {
    CallThreads threads(16);
    std::vector<std::thread> starters;
    for (int i = 0; i < 4; ++i)
      starters.emplace_back([&] {
        for (int k = 0; k < 500; ++k)
          if (threads.run([&] { ran.fetch_add(1); })) accepted.fetch_add(1);
      });
    for (std::thread& starter : starters) starter.join();
  }
  EXPECT_EQ(ran.load(), accepted.load());
  EXPECT_GT(ran.load(), 0);
}

}  // namespace
}  // namespace locus::server
