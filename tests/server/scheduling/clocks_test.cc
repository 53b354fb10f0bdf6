#include "server/scheduling/clocks.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace locus::server {
namespace {

TEST(ClocksTest, ThreadClockCountsWorkButNotSleep) {
  const uint64_t start = thread_nanoseconds();
  while (thread_nanoseconds() < start + 1'000'000) {
  }
  const uint64_t worked = thread_nanoseconds();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_GE(worked - start, 1'000'000u);
  EXPECT_LT(thread_nanoseconds() - worked, 100'000'000u);
}

TEST(ClocksTest, EachThreadHasItsOwnThreadClock) {
  while (thread_nanoseconds() < 1'000'000) {
  }
  uint64_t other = 0;
  std::thread([&other] { other = thread_nanoseconds(); }).join();
  EXPECT_LT(other, thread_nanoseconds());
}

}  // namespace
}  // namespace locus::server
