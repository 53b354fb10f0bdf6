#include "server/scheduling/memory_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <thread>
#include <vector>

#include "core/base/refusal.h"

namespace locus::server {
namespace {

constexpr uint64_t kLimit = 3200;

class MemoryBudgetTest : public testing::Test {
 protected:
  MemoryBudget::Meter meter() {
    return {[this] {
              ++measurements_;
              return used_;
            },
            [this] {
              ++given_back_;
              used_ -= spare_;
              spare_ = 0;
            }};
  }

  uint64_t used_ = 0;
  uint64_t spare_ = 0;  // part of used_ that release_memory() frees
  int measurements_ = 0;
  int given_back_ = 0;
};

TEST_F(MemoryBudgetTest, WorkFitsUpToTheLimitAndNotBeyond) {
  used_ = 1200;
  MemoryBudget budget(kLimit, meter());
  EXPECT_TRUE(budget.claim("inserts", 2000).ok());
  EXPECT_FALSE(budget.claim("inserts", 2001).ok());
}

TEST_F(MemoryBudgetTest, ARefusalNamesTheLimitAndWhatToDo) {
  used_ = 3000;
  MemoryBudget budget(kLimit, meter());
  const absl::Status status = budget.claim("inserts", 500).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("--memory-limit"));
  const std::optional<Refusal> refusal = refusal_of(status);
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Reason::kLimit);
  EXPECT_EQ(refusal->field, "inserts");
  EXPECT_EQ(refusal->limit, "memory_bytes");
  EXPECT_EQ(refusal->limit_value, kLimit);
  EXPECT_EQ(refusal->asked, 3500);
}

TEST_F(MemoryBudgetTest, AClaimCountsUntilTheWorkEnds) {
  MemoryBudget budget(kLimit, meter());
  std::optional<MemoryBudget::Claim> first(*budget.claim("mesh", 3000));
  EXPECT_FALSE(budget.claim("mesh", 300).ok());
  first.reset();
  EXPECT_TRUE(budget.claim("mesh", 300).ok());
}

TEST_F(MemoryBudgetTest, MemoryUsedByEndedWorkCountsAfterwards) {
  MemoryBudget budget(kLimit, meter());
  EXPECT_TRUE(budget.claim("mesh", 3000).ok());
  used_ = 2500;
  EXPECT_FALSE(budget.claim("mesh", 800).ok());
  EXPECT_TRUE(budget.claim("mesh", 700).ok());
}

TEST_F(MemoryBudgetTest, MemoryIsReleasedBeforeWorkIsRefused) {
  used_ = 3000;
  spare_ = 1000;
  MemoryBudget budget(kLimit, meter());
  EXPECT_TRUE(budget.claim("inserts", 1200).ok());
  EXPECT_EQ(given_back_, 1);
}

TEST_F(MemoryBudgetTest, WorkLargerThanTheLimitReleasesNoMemory) {
  MemoryBudget budget(kLimit, meter());
  EXPECT_FALSE(budget.claim("mesh", kLimit + 1).ok());
  EXPECT_FALSE(budget.claim("mesh", UINT64_MAX).ok());
  EXPECT_EQ(given_back_, 0);
}

TEST_F(MemoryBudgetTest, WorkThatIsNeverRefusedReleasesMemoryToo) {
  used_ = 3300;
  spare_ = 1000;
  MemoryBudget budget(kLimit, meter());
  for (int i = 0; i < 3; ++i) const MemoryBudget::Claim claim = budget.claim_anyway(60);
  EXPECT_EQ(given_back_, 1);
  EXPECT_LE(used_, kLimit);
}

TEST_F(MemoryBudgetTest, SmallWorkIsMeasuredRarely) {
  MemoryBudget budget(kLimit, meter());
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(budget.claim("inserts", 1).ok());
  EXPECT_LT(measurements_, 20);
}

TEST_F(MemoryBudgetTest, ManyThreadsNeverClaimMoreThanTheLimit) {
  MemoryBudget budget(kLimit, meter());
  std::vector<std::thread> threads;
  Mutex mutex;
  uint64_t claimed = 0;
  bool exceeded = false;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      for (int round = 0; round < 300; ++round) {
        const absl::StatusOr<MemoryBudget::Claim> claim = budget.claim("inserts", 1000);
        if (!claim.ok()) continue;
        {
          MutexLock lock(mutex);
          claimed += 1000;
          exceeded = exceeded || claimed > kLimit;
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
