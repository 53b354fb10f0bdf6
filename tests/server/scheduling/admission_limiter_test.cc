#include "server/scheduling/admission_limiter.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace locus::server {
namespace {

using Clock = std::chrono::steady_clock;

TEST(AdmissionLimiterTest, NeverMorePermitsThanTheMaximum) {
  AdmissionLimiter gate(2);
  const AdmissionLimiter::Permit first = gate.enter();
  {
    const AdmissionLimiter::Permit second = gate.enter();
    EXPECT_TRUE(second);
    EXPECT_FALSE(gate.enter());
    EXPECT_EQ(gate.used(), 2u);
  }
  EXPECT_EQ(gate.used(), 1u);
  EXPECT_TRUE(gate.enter());
}

TEST(AdmissionLimiterTest, WaitUntilEmptyReturnsWhenTheLastPermitIsReleased) {
  AdmissionLimiter gate(4);
  AdmissionLimiter::Permit pass = gate.enter();
  EXPECT_FALSE(gate.wait_until_empty(Clock::now()));
  std::thread leaver([moved = std::move(pass)]() mutable { AdmissionLimiter::Permit gone = std::move(moved); });
  EXPECT_TRUE(gate.wait_until_empty(Clock::now() + std::chrono::minutes(1)));
  leaver.join();
}

TEST(AdmissionLimiterTest, ManyThreadsNeverExceedTheMaximum) {
  AdmissionLimiter gate(3);
  std::atomic<int> inside{0};
  std::atomic<bool> exceeded{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&] {
      for (int round = 0; round < 500; ++round) {
        const AdmissionLimiter::Permit pass = gate.enter();
        if (!pass) continue;
        if (++inside > 3) exceeded = true;
        --inside;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(exceeded.load());
  EXPECT_EQ(gate.used(), 0u);
}

}  // namespace
}  // namespace locus::server
