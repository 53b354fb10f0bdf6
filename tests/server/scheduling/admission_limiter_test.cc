#include "server/scheduling/admission_limiter.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace locus::server {
namespace {

using Clock = std::chrono::steady_clock;

TEST(AdmissionLimiterTest, NeverMorePermitsThanTheMaximum) {
  AdmissionLimiter limiter(2);
  const AdmissionLimiter::Permit first = limiter.enter();
  {
    const AdmissionLimiter::Permit second = limiter.enter();
    EXPECT_TRUE(second);
    EXPECT_FALSE(limiter.enter());
    EXPECT_EQ(limiter.used(), 2u);
  }
  EXPECT_EQ(limiter.used(), 1u);
  EXPECT_TRUE(limiter.enter());
}

TEST(AdmissionLimiterTest, WaitUntilEmptyReturnsWhenTheLastPermitIsReleased) {
  AdmissionLimiter limiter(4);
  AdmissionLimiter::Permit permit = limiter.enter();
  EXPECT_FALSE(limiter.wait_until_empty(Clock::now()));
  std::thread leaver([moved = std::move(permit)]() mutable { AdmissionLimiter::Permit gone = std::move(moved); });
  EXPECT_TRUE(limiter.wait_until_empty(Clock::now() + std::chrono::minutes(1)));
  leaver.join();
}

TEST(AdmissionLimiterTest, ManyThreadsNeverExceedTheMaximum) {
  AdmissionLimiter limiter(3);
  std::atomic<int> inside{0};
  std::atomic<bool> exceeded{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&] {
      for (int round = 0; round < 500; ++round) {
        const AdmissionLimiter::Permit permit = limiter.enter();
        if (!permit) continue;
        if (++inside > 3) exceeded = true;
        --inside;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(exceeded.load());
  EXPECT_EQ(limiter.used(), 0u);
}

}  // namespace
}  // namespace locus::server
