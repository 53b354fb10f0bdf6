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

// Returns the permits that `owner` gets until it is refused.
std::vector<AdmissionLimiter::Permit> take_all(AdmissionLimiter& limiter, uint64_t owner) {
  std::vector<AdmissionLimiter::Permit> permits;
  while (AdmissionLimiter::Permit permit = limiter.enter(owner)) permits.push_back(std::move(permit));
  return permits;
}

TEST(AdmissionLimiterTest, AnOwnerThatIsAloneGetsTheMaximumOfAFairLimiter) {
  for (const uint32_t max : {1u, 2u, 3u, 4u, 32u, 256u, 1024u}) {
    AdmissionLimiter limiter(max, Sharing::kFair);
    EXPECT_EQ(take_all(limiter, 7).size(), max);
    EXPECT_EQ(limiter.used(), 0u);
  }
}

TEST(AdmissionLimiterTest, AnOwnerThatKeepsAllItGetsLeavesPermitsToOthers) {
  AdmissionLimiter limiter(256, Sharing::kFair);
  std::vector<std::vector<AdmissionLimiter::Permit>> greedy;
  greedy.push_back(take_all(limiter, 0));
  for (uint64_t owner = 1; owner <= 7; ++owner) {
    greedy.push_back(take_all(limiter, owner));
    EXPECT_EQ(greedy.back().size(), 11u);  // an eighth of the reserve of 86 permits, rounded up
    EXPECT_FALSE(limiter.enter(owner));
    EXPECT_TRUE(limiter.enter(100 + owner));
  }
  while (limiter.used() < limiter.max_in_all()) greedy.push_back(take_all(limiter, greedy.size()));
  EXPECT_FALSE(limiter.enter(1000));
}

TEST(AdmissionLimiterTest, AnOwnerThatWasRefusedIsAdmittedWhenPermitsEnd) {
  AdmissionLimiter limiter(32, Sharing::kFair);
  std::vector<AdmissionLimiter::Permit> first = take_all(limiter, 1), second = take_all(limiter, 2);
  EXPECT_EQ(second.size(), 2u);
  first.clear();
  while (second.size() < 32) {
    second.push_back(limiter.enter(2));
    ASSERT_TRUE(second.back());
  }
  EXPECT_FALSE(limiter.enter(2));
}

TEST(AdmissionLimiterTest, AFirstComeLimiterNeverExceedsItsMaximum) {
  AdmissionLimiter limiter(1);
  const AdmissionLimiter::Permit only = limiter.enter(1);
  EXPECT_FALSE(limiter.enter(2));
  EXPECT_EQ(limiter.max_in_all(), 1u);
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
  for (uint64_t i = 0; i < 8; ++i)
    threads.emplace_back([&, i] {
      for (int round = 0; round < 500; ++round) {
        const AdmissionLimiter::Permit permit = limiter.enter(i % 3);
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
