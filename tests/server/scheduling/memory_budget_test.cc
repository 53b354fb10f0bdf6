#include "server/scheduling/memory_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <thread>
#include <vector>

#include "core/base/refusal.h"

namespace locus::server {
namespace {

// Memory limit whose ceiling for growth is kCeiling, both in bytes.
constexpr uint64_t kLimitBytes = 3657;
constexpr uint64_t kCeiling = 3200;

class MemoryBudgetTest : public testing::Test {
 protected:
  MemoryBudget::Meter meter() {
    return [this] {
      ++measurements_;
      return used_;
    };
  }

  uint64_t used_ = 0;
  int measurements_ = 0;
};

TEST_F(MemoryBudgetTest, AConnectionMayHoldHalfOfWhatIsLeftForClaims) {
  constexpr uint64_t kLarge = uint64_t{1} << 30;
  used_ = kLarge / 2;
  MemoryBudget budget(kLarge, meter());
  EXPECT_EQ(budget.connection_share(), kLarge / 4);
  const absl::StatusOr<MemoryBudget::Claim> claim = budget.claim(MemoryLine::kReplies, "", kLarge / 4);
  ASSERT_TRUE(claim.ok());
  used_ += kLarge / 4;  // the claimed memory is now allocated
  budget.refresh();
  EXPECT_EQ(budget.connection_share(), kLarge / 4) << "claims do not make it smaller";
  used_ = kLarge * 2;
  budget.refresh();
  EXPECT_GT(budget.connection_share(), 0u) << "half of the reserve of small claims";
  EXPECT_LT(budget.connection_share(), kLarge / 16);
}

TEST_F(MemoryBudgetTest, RefusedClaimsAreCountedForEachLine) {
  used_ = kLimitBytes;
  MemoryBudget budget(kLimitBytes, meter());
  EXPECT_FALSE(budget.claim(MemoryLine::kDumps, "", 100).ok());
  EXPECT_FALSE(budget.claim(MemoryLine::kDumps, "", 100).ok());
  EXPECT_EQ(budget.refused(MemoryLine::kDumps), 2u);
  EXPECT_EQ(budget.refused(MemoryLine::kUploads), 0u);
}

TEST_F(MemoryBudgetTest, WorkFitsUpToTheLimitAndNotBeyond) {
  used_ = 1200;
  MemoryBudget budget(kLimitBytes, meter());
  EXPECT_TRUE(budget.claim(MemoryLine::kUploads, "inserts", 2000).ok());
  EXPECT_FALSE(budget.claim(MemoryLine::kUploads, "inserts", 2001).ok());
}

TEST_F(MemoryBudgetTest, ARefusalNamesTheLimitAndWhatToDo) {
  used_ = 3000;
  MemoryBudget budget(kLimitBytes, meter());
  const absl::Status status = budget.claim(MemoryLine::kUploads, "inserts", 500).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("--memory-limit"));
  const std::optional<Refusal> refusal = refusal_of(status);
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Reason::kLimit);
  EXPECT_EQ(refusal->field, "inserts");
  EXPECT_EQ(refusal->limit, "memory_bytes");
  EXPECT_EQ(refusal->limit_value, kLimitBytes);
  EXPECT_EQ(refusal->asked, 3500);
}

TEST_F(MemoryBudgetTest, AClaimCountsUntilTheWorkEnds) {
  MemoryBudget budget(kLimitBytes, meter());
  std::optional<MemoryBudget::Claim> first(*budget.claim(MemoryLine::kUploads, "mesh", 3000));
  EXPECT_FALSE(budget.claim(MemoryLine::kUploads, "mesh", 300).ok());
  first.reset();
  EXPECT_TRUE(budget.claim(MemoryLine::kUploads, "mesh", 300).ok());
}

TEST_F(MemoryBudgetTest, MemoryUsedByEndedWorkCountsAfterwards) {
  MemoryBudget budget(kLimitBytes, meter());
  EXPECT_TRUE(budget.claim(MemoryLine::kUploads, "mesh", 3000).ok());
  used_ = 2500;
  EXPECT_FALSE(budget.claim(MemoryLine::kUploads, "mesh", 800).ok());
  EXPECT_TRUE(budget.claim(MemoryLine::kUploads, "mesh", 700).ok());
}

TEST_F(MemoryBudgetTest, MemoryIsMeasuredBeforeWorkIsRefused) {
  used_ = 3000;
  MemoryBudget budget(kLimitBytes, meter());
  used_ = 2000;
  EXPECT_TRUE(budget.claim(MemoryLine::kUploads, "inserts", 1200).ok());
  EXPECT_FALSE(budget.take_shortage());
}

TEST_F(MemoryBudgetTest, WorkLargerThanTheLimitIsNoShortage) {
  MemoryBudget budget(kLimitBytes, meter());
  EXPECT_FALSE(budget.claim(MemoryLine::kUploads, "mesh", kCeiling + 1).ok());
  EXPECT_FALSE(budget.claim(MemoryLine::kUploads, "mesh", UINT64_MAX).ok());
  EXPECT_FALSE(budget.take_shortage());
}

TEST_F(MemoryBudgetTest, ARefusedClaimIsAShortageThatIsReportedOnce) {
  used_ = 3300;
  MemoryBudget budget(kLimitBytes, meter());
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(budget.claim(MemoryLine::kUploads, "mesh", 60).ok());
  EXPECT_TRUE(budget.take_shortage());
  EXPECT_FALSE(budget.take_shortage());
}

TEST_F(MemoryBudgetTest, GrowthIsRefusedFirstThenMovesThenQueries) {
  constexpr uint64_t kLarge = uint64_t{1} << 30;
  used_ = kLarge - kLarge / 8;
  MemoryBudget budget(kLarge, meter());
  constexpr uint64_t kSome = 1u << 20;
  EXPECT_FALSE(budget.claim(MemoryLine::kUploads, "mesh", kSome).ok());
  EXPECT_FALSE(budget.claim(MemoryLine::kDumps, "mesh", kSome).ok());
  EXPECT_FALSE(budget.claim(MemoryLine::kInserts, "inserts", kSome).ok());
  EXPECT_TRUE(budget.claim(MemoryLine::kMoves, "moves", kSome).ok());
  used_ = kLarge - 3 * (kLarge / 32);
  budget.refresh();
  EXPECT_FALSE(budget.claim(MemoryLine::kMoves, "moves", kSome).ok());
  EXPECT_TRUE(budget.claim(MemoryLine::kRequests, "", kSome).ok());
  EXPECT_TRUE(budget.claim(MemoryLine::kReplies, "", kSome).ok());
  used_ = kLarge;
  budget.refresh();
  EXPECT_FALSE(budget.claim(MemoryLine::kReplies, "", kSome).ok());
}

TEST_F(MemoryBudgetTest, SmallClaimsHaveAReserveThatIsBounded) {
  used_ = 2 * kLimitBytes;
  MemoryBudget budget(kLimitBytes, meter());
  std::vector<MemoryBudget::Claim> claims;
  for (uint64_t owner = 0; owner < 4; ++owner) {
    for (int i = 0; i < 16; ++i) {  // 1 MiB for each owner
      absl::StatusOr<MemoryBudget::Claim> claim = budget.claim(MemoryLine::kRequests, "", 64u << 10, owner);
      ASSERT_TRUE(claim.ok()) << claim.status();
      claims.push_back(*std::move(claim));
    }
    EXPECT_FALSE(budget.claim(MemoryLine::kReplies, "", 1, owner).ok());
  }
  EXPECT_FALSE(budget.claim(MemoryLine::kReplies, "", 1, 4).ok());
  EXPECT_FALSE(budget.claim(MemoryLine::kInserts, "", 1, 4).ok());
  claims.pop_back();
  EXPECT_TRUE(budget.claim(MemoryLine::kReplies, "", 1, 4).ok());
  EXPECT_FALSE(budget.claim(MemoryLine::kReplies, "", (64u << 10) + 1, 4).ok());
  claims.clear();
  EXPECT_TRUE(budget.claim(MemoryLine::kReplies, "", 64u << 10, 0).ok());
}

TEST_F(MemoryBudgetTest, AnEmptyClaimSucceedsInAFullProcessAndUsesNoReserve) {
  used_ = kLimitBytes;
  MemoryBudget budget(kLimitBytes, meter());
  for (uint64_t owner = 0; owner < 100; ++owner) EXPECT_TRUE(budget.claim(MemoryLine::kMoves, "", 0, owner).ok());
  EXPECT_EQ(budget.taken(), kLimitBytes);
}

TEST_F(MemoryBudgetTest, OrdinaryClaimsLeaveTheReserveToOthers) {
  constexpr uint64_t kLarge = uint64_t{1} << 30;
  MemoryBudget budget(kLarge, meter());
  std::vector<MemoryBudget::Claim> claims;
  while (true) {
    absl::StatusOr<MemoryBudget::Claim> claim = budget.claim(MemoryLine::kReplies, "", 12u << 20, 1);
    if (!claim.ok()) break;
    claims.push_back(*std::move(claim));
  }
  EXPECT_LT(budget.ceiling(MemoryLine::kReplies) - budget.taken(), 12u << 20);
  for (int i = 0; i < 1000; ++i) {  // owner 1 claims the rest, then its own part of the reserve
    absl::StatusOr<MemoryBudget::Claim> claim = budget.claim(MemoryLine::kReplies, "", 64u << 10, 1);
    if (!claim.ok()) break;
    claims.push_back(*std::move(claim));
  }
  EXPECT_FALSE(budget.claim(MemoryLine::kReplies, "", 64u << 10, 1).ok());
  EXPECT_TRUE(budget.claim(MemoryLine::kRequests, "", 64u << 10, 2).ok());
  EXPECT_LE(budget.taken(), kLarge);
}

TEST_F(MemoryBudgetTest, AClaimCanShrinkAndMove) {
  MemoryBudget budget(kLimitBytes, meter());
  MemoryBudget::Claim claim = *budget.claim(MemoryLine::kUploads, "mesh", 3000);
  claim.shrink(100);
  claim.shrink(500);
  EXPECT_EQ(claim.bytes(), 100u);
  EXPECT_EQ(budget.claimed(MemoryLine::kUploads), 100u);
  MemoryBudget::Claim other = std::move(claim);
  claim = MemoryBudget::Claim();
  EXPECT_EQ(budget.claimed(MemoryLine::kUploads), 100u);
  other.release();
  EXPECT_EQ(budget.claimed(MemoryLine::kUploads), 0u);
}

TEST_F(MemoryBudgetTest, SmallWorkIsMeasuredRarely) {
  MemoryBudget budget(kLimitBytes, meter());
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(budget.claim(MemoryLine::kUploads, "inserts", 1).ok());
  EXPECT_LT(measurements_, 20);
}

TEST_F(MemoryBudgetTest, ManyThreadsNeverClaimMoreThanTheLimit) {
  MemoryBudget budget(kLimitBytes, meter());
  std::vector<std::thread> threads;
  Mutex mutex;
  uint64_t claimed = 0;
  bool exceeded = false;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      for (int round = 0; round < 300; ++round) {
        const absl::StatusOr<MemoryBudget::Claim> claim = budget.claim(MemoryLine::kUploads, "inserts", 1000);
        if (!claim.ok()) continue;
        {
          MutexLock lock(mutex);
          claimed += 1000;
          exceeded = exceeded || claimed > kCeiling;
        }
        MutexLock lock(mutex);
        claimed -= 1000;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(exceeded);
}

}  // namespace
}  // namespace locus::server
