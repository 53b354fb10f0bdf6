// Tests Expiries: when objects are due, what restarted ticks change, and the tables of readers.
#include "core/scene/objects/expiries.h"

#include <gmock/gmock.h>

#include "core/base/limits.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr uint64_t kLastTick = std::numeric_limits<uint64_t>::max();

TEST(ExpiriesTest, AnObjectIsDueAtItsTickAndNotBefore) {
  Expiries expiries;
  EXPECT_FALSE(expiries.due(kLastTick));
  EXPECT_TRUE(expiries.set(3, 10, 5));
  EXPECT_FALSE(expiries.due(14));
  EXPECT_TRUE(expiries.due(15));
  EXPECT_THAT(expiries.due_handles(14), IsEmpty());
  EXPECT_THAT(expiries.due_handles(15), ElementsAre(3));
}

TEST(ExpiriesTest, DueHandlesAreInTheOrderOfTheirExpiries) {
  Expiries expiries;
  expiries.set(1, 0, 30);
  expiries.set(2, 0, 10);
  expiries.set(3, 0, 20);
  expiries.set(4, 0, 40);
  EXPECT_THAT(expiries.due_handles(35), ElementsAre(2, 3, 1));
}

TEST(ExpiriesTest, SettingAgainReplacesAndZeroForgets) {
  Expiries expiries;
  EXPECT_FALSE(expiries.set(1, 0, 0));
  EXPECT_TRUE(expiries.set(1, 0, 5));
  EXPECT_FALSE(expiries.set(1, 2, 3));  // the same tick
  EXPECT_TRUE(expiries.set(1, 2, 9));
  EXPECT_FALSE(expiries.due(10));
  EXPECT_TRUE(expiries.due(11));
  EXPECT_TRUE(expiries.set(1, 2, 0));
  EXPECT_TRUE(expiries.empty());
  EXPECT_FALSE(expiries.due(kLastTick));
}

TEST(ExpiriesTest, ATransferredExpiryStaysTheSame) {
  Expiries expiries;
  expiries.set(1, 0, 5);
  expiries.transfer(1, 7);
  expiries.transfer(2, 8);  // does not expire
  EXPECT_THAT(expiries.due_handles(100), ElementsAre(7));
  expiries.erase(7);
  EXPECT_TRUE(expiries.empty());
}

TEST(ExpiriesTest, RestartedTicksKeepTheRemainingTicks) {
  for (const uint64_t to : {uint64_t{0}, uint64_t{3}, uint64_t{100}, kLastTick - 20}) {
    Expiries expiries;
    expiries.set(1, 5, 10);
    expiries.restart(8, to);
    EXPECT_EQ(expiries.table()->remaining(1, to), 7u);
    EXPECT_FALSE(expiries.due(to + 6));
    EXPECT_TRUE(expiries.due(to + 7));
  }
}

TEST(ExpiriesTest, TicksNearTheGreatestDoNotOverflow) {
  Expiries expiries;
  expiries.set(1, 0, limits::kMaxExpireTicks);
  expiries.restart(1, kLastTick - 2);
  expiries.set(2, kLastTick - 2, 2);
  expiries.set(3, kLastTick - 2, limits::kMaxExpireTicks);
  EXPECT_THAT(expiries.due_handles(kLastTick), ElementsAre(2));
  expiries.erase(2);
  expiries.restart(kLastTick, 0);
  EXPECT_EQ(expiries.table()->remaining(1, 0), limits::kMaxExpireTicks - 3);
  EXPECT_EQ(expiries.table()->remaining(3, 0), limits::kMaxExpireTicks - 2);
}

TEST(ExpiriesTest, KeysAreCountedFromALaterTickWhenManyTicksHavePassed) {
  Expiries expiries;
  expiries.set(1, 0, limits::kMaxExpireTicks);
  // Each restart keeps the remaining ticks, and each step lets ticks pass.
  uint64_t tick = 0, left = limits::kMaxExpireTicks;
  for (int i = 0; i < 20'000 && left > 1; ++i) {
    const uint64_t step = left / 2;
    tick += step;
    left -= step;
    expiries.set(2, tick, limits::kMaxExpireTicks);
    ASSERT_EQ(expiries.table()->remaining(1, tick), left);
  }
  expiries.erase(1);
  tick += uint64_t{1} << 47;
  ASSERT_FALSE(expiries.due(tick));
  for (int i = 0; i < 40'000; ++i) {  // until the ticks since the first insertion exceed 2^62
    expiries.set(3, tick, limits::kMaxExpireTicks);
    expiries.erase(2);
    tick += limits::kMaxExpireTicks - 1;
    ASSERT_FALSE(expiries.due(tick));
    ASSERT_TRUE(expiries.due(tick + 1));
    expiries.set(2, tick, limits::kMaxExpireTicks);
    ASSERT_EQ(expiries.table()->remaining(3, tick), 1u);
    expiries.erase(3);
  }
}

TEST(ExpiriesTest, ATableIsOfItsRevisionAndIsSharedUntilAnExpiryChanges) {
  Expiries expiries;
  EXPECT_EQ(expiries.table(), nullptr);
  expiries.set(1, 0, 5);
  const std::shared_ptr<const ExpiryTable> before = expiries.table();
  EXPECT_EQ(expiries.table(), before);
  expiries.set(1, 1, 5);
  expiries.set(2000, 1, 7);
  EXPECT_EQ(before->remaining(1, 0), 5u);
  EXPECT_EQ(before->remaining(2000, 0), 0u);
  EXPECT_EQ(before->count(), 1u);
  EXPECT_EQ(expiries.table()->remaining(1, 1), 5u);
  EXPECT_EQ(expiries.table()->remaining(2000, 1), 7u);
  EXPECT_GT(expiries.table()->unshared_bytes(before.get()), 0u);
  expiries.erase(1);
  expiries.erase(2000);
  EXPECT_EQ(expiries.table(), nullptr);
}

}  // namespace
}  // namespace locus::test
