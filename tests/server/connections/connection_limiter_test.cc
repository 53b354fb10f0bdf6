#include "server/connections/connection_limiter.h"

#include <gtest/gtest.h>

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using Time = ConnectionLimiter::Time;

ConnectionLimits limits_of(uint32_t connections, uint32_t per_address, uint32_t new_per_second, uint32_t burst) {
  return {connections, per_address, new_per_second, burst};
}

TEST(ConnectionLimiterTest, AnAddressMayHaveItsMaximumAndOthersTheirs) {
  ConnectionLimiter limiter(limits_of(100, 3, 100, 100));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(limiter.admit("a", Time()), Admission::kAdmitted);
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kAddressFull);
  EXPECT_EQ(limiter.admit("b", Time()), Admission::kAdmitted);
  limiter.leave("a");
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kAdmitted);
  EXPECT_EQ(limiter.connections(), 4u);
}

TEST(ConnectionLimiterTest, AChargedAddressWaitsAndOthersDoNot) {
  ConnectionLimiter limiter(limits_of(100, 100, 10, 10));
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kAdmitted);
  limiter.charge("a", 14);  // 9 of 10 tokens are left after the admission, so the address owes 5 tokens
  limiter.charge("unknown", 100);
  EXPECT_EQ(limiter.admit("b", Time()), Admission::kAdmitted);
  EXPECT_EQ(limiter.admit("unknown", Time()), Admission::kAdmitted);
  EXPECT_EQ(limiter.admit("a", Time() + milliseconds(590)), Admission::kTooFast);
  EXPECT_EQ(limiter.admit("a", Time() + milliseconds(610)), Admission::kAdmitted);
}

TEST(ConnectionLimiterTest, AnAddressIsChargedAtMostOneBurst) {
  ConnectionLimiter limiter(limits_of(100, 100, 10, 10));
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kAdmitted);
  for (int i = 0; i < 100; ++i) limiter.charge("a", 10);
  EXPECT_EQ(limiter.admit("a", Time() + milliseconds(1090)), Admission::kTooFast);
  EXPECT_EQ(limiter.admit("a", Time() + milliseconds(1110)), Admission::kAdmitted);
}

TEST(ConnectionLimiterTest, AllAddressesTogetherMayHaveTheMaximum) {
  ConnectionLimiter limiter(limits_of(2, 10, 100, 100));
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kAdmitted);
  EXPECT_EQ(limiter.admit("b", Time()), Admission::kAdmitted);
  EXPECT_EQ(limiter.admit("c", Time()), Admission::kFull);
  limiter.leave("b");
  EXPECT_EQ(limiter.admit("c", Time()), Admission::kAdmitted);
}

TEST(ConnectionLimiterTest, NewConnectionsAreLimitedByBurstAndRate) {
  ConnectionLimiter limiter(limits_of(1000, 1000, 10, 5));
  Time now;
  const auto admitted = [&] {
    int count = 0;
    while (limiter.admit("a", now) == Admission::kAdmitted) ++count;
    return count;
  };
  EXPECT_EQ(admitted(), 5);
  now += milliseconds(300);
  EXPECT_EQ(admitted(), 3);
  now += milliseconds(60'000);
  EXPECT_EQ(admitted(), 5);
  EXPECT_EQ(limiter.admit("a", now), Admission::kTooFast);
  EXPECT_EQ(limiter.admit("b", now), Admission::kAdmitted);
}

TEST(ConnectionLimiterTest, ClosedConnectionsDoNotRaiseTheRate) {
  ConnectionLimiter limiter(limits_of(1000, 1000, 10, 5));
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(limiter.admit("a", Time()), Admission::kAdmitted);
    limiter.leave("a");
  }
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kTooFast);
}

TEST(ConnectionLimiterTest, RefusedAttemptsUseUpTheBurstToo) {
  ConnectionLimiter limiter(limits_of(1000, 1, 1, 3));
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kAdmitted);
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kAddressFull);
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kAddressFull);
  EXPECT_EQ(limiter.admit("a", Time()), Admission::kTooFast);
}

TEST(ConnectionLimiterTest, AddressesWithoutConnectionsAreForgotten) {
  ConnectionLimiter limiter(limits_of(100'000, 10, 100, 100));
  Time now;
  EXPECT_EQ(limiter.admit("stays", now), Admission::kAdmitted);
  for (int i = 0; i < 20'000; ++i) {
    now += milliseconds(1);
    const std::string address = std::to_string(i);
    ASSERT_EQ(limiter.admit(address, now), Admission::kAdmitted);
    limiter.leave(address);
  }
  EXPECT_LT(limiter.addresses(), 5000u);
  EXPECT_EQ(limiter.connections(), 1u);
  limiter.leave("stays");
}

}  // namespace
}  // namespace locus::server
