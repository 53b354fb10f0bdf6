#include "server/security/quotas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using testing::HasSubstr;

constexpr uint64_t kSecond = 1'000'000'000;
constexpr uint64_t kMillisecond = 1'000'000;
constexpr uint64_t kStart = 5 * kSecond;

Quota quota(QuotaKind kind, double limit, double burst_s = 2) {
  Quota made;
  made.limits[static_cast<size_t>(kind)] = limit;
  made.burst_s = burst_s;
  return made;
}

class QuotasTest : public testing::Test {
 protected:
  // Returns a source that gives every subject the same quota.
  Quotas::QuotaOf source() {
    return [this](absl::string_view) { return quota_; };
  }

  Quota quota_;
};

TEST_F(QuotasTest, ARateAllowsTwoSecondsAtOnceAndThenItsRate) {
  quota_ = quota(QuotaKind::kQueries, 1000);
  Quotas quotas(source());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 2000, kStart).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 1, kStart).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 101, kStart + 100 * kMillisecond).ok());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 100, kStart + 100 * kMillisecond).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 1, kStart + 100 * kMillisecond).ok());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 2000, kStart + 60 * kSecond).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 1, kStart + 60 * kSecond).ok());
}

TEST_F(QuotasTest, ARateThatIsGivenBackLaterDoesNotExceedTheBurst) {
  quota_ = quota(QuotaKind::kQueries, 1000);
  Quotas quotas(source());
  ASSERT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 1500, kStart).ok());
  ASSERT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 0, kStart + 60 * kSecond).ok());
  quotas.give_back("token:ci", QuotaKind::kQueries, 1500);
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 2001, kStart + 60 * kSecond).ok());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 2000, kStart + 60 * kSecond).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 1, kStart + 60 * kSecond).ok());
}

TEST_F(QuotasTest, ARefusedRateSaysWhenToTryAgainAndIsThenAllowed) {
  quota_ = quota(QuotaKind::kQueries, 1000);
  Quotas quotas(source());
  ASSERT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 2000, kStart).ok());
  const absl::Status status = quotas.take("token:ci", QuotaKind::kQueries, 500, kStart);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("quota queries_per_s of token:ci is 1000, asked for 500"));
  const Refusal refusal = refusal_of(status).value();
  EXPECT_EQ(refusal.reason, Reason::kLimit);
  EXPECT_EQ(refusal.limit, "queries_per_s");
  EXPECT_EQ(refusal.limit_value, 1000);
  EXPECT_EQ(refusal.asked, 500);
  EXPECT_EQ(refusal.retry_after_ms, 500u);
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 500, kStart + 499 * kMillisecond).ok());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 500, kStart + 500 * kMillisecond).ok());
}

TEST_F(QuotasTest, MoreThanTheBurstIsRefusedWithoutATimeToTryAgain) {
  quota_ = quota(QuotaKind::kUpdateItems, 10, 5);
  Quotas quotas(source());
  const absl::Status status = quotas.take("token:ci", QuotaKind::kUpdateItems, 51, kStart);
  EXPECT_THAT(std::string(status.message()), HasSubstr("send smaller batches"));
  EXPECT_EQ(refusal_of(status)->retry_after_ms, 0u);
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kUpdateItems, 50, kStart).ok());
}

TEST_F(QuotasTest, AQuotaOfZeroAllowsNothing) {
  quota_ = quota(QuotaKind::kQueries, 0);
  quota_.limits[static_cast<size_t>(QuotaKind::kScenes)] = 0;
  Quotas quotas(source());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 1, kStart + 1000 * kSecond).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kScenes, 1, kStart).ok());
}

TEST_F(QuotasTest, WorkIsChargedAfterwardsAndTheNextTakeWaits) {
  quota_ = quota(QuotaKind::kWork, 1000);
  Quotas quotas(source());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kWork, 0, kStart).ok());
  quotas.charge("token:ci", QuotaKind::kWork, 7000, kStart);
  const absl::Status status = quotas.take("token:ci", QuotaKind::kWork, 0, kStart);
  EXPECT_EQ(refusal_of(status)->retry_after_ms, 5000u);
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kWork, 0, kStart + 4999 * kMillisecond).ok());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kWork, 0, kStart + 5 * kSecond).ok());
}

TEST_F(QuotasTest, AnAmountIsInUseUntilItIsReleased) {
  quota_ = quota(QuotaKind::kOpenStreams, 2);
  Quotas quotas(source());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kOpenStreams, 1, kStart).ok());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kOpenStreams, 1, kStart).ok());
  const absl::Status status = quotas.take("token:ci", QuotaKind::kOpenStreams, 1, kStart + 100 * kSecond);
  EXPECT_THAT(std::string(status.message()), HasSubstr("2 are in use"));
  quotas.release("token:ci", QuotaKind::kOpenStreams, 1);
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kOpenStreams, 1, kStart).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kOpenStreams, 1, kStart).ok());
}

TEST_F(QuotasTest, AnAmountChargedBeyondTheQuotaStopsFurtherOnes) {
  quota_ = quota(QuotaKind::kObjects, 10);
  Quotas quotas(source());
  quotas.charge("token:ci", QuotaKind::kObjects, 15, kStart);
  quotas.release("token:ci", QuotaKind::kObjects, 5);
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kObjects, 1, kStart).ok());
  quotas.release("token:ci", QuotaKind::kObjects, 1);
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kObjects, 1, kStart).ok());
}

TEST_F(QuotasTest, BytesInFlightAreWorthWaitingForUnlessTheyNeverFit) {
  quota_ = quota(QuotaKind::kBytesInFlight, 100);
  Quotas quotas(source());
  ASSERT_TRUE(quotas.take("a", QuotaKind::kBytesInFlight, 60, kStart).ok());
  EXPECT_GT(refusal_of(quotas.take("a", QuotaKind::kBytesInFlight, 60, kStart))->retry_after_ms, 0u);
  EXPECT_EQ(refusal_of(quotas.take("a", QuotaKind::kBytesInFlight, 101, kStart))->retry_after_ms, 0u);
}

TEST_F(QuotasTest, AHoldGivesBackWhatItTookFromEachSubject) {
  quota_ = quota(QuotaKind::kBytesInFlight, 100);
  Quotas quotas(source());
  const std::vector<std::string> both = {"a", "connection:x"}, other = {"b", "connection:x"};
  {
    absl::StatusOr<QuotaHold> hold = quotas.hold(both, QuotaKind::kBytesInFlight, 60, kStart);
    ASSERT_TRUE(hold.ok());
    EXPECT_FALSE(quotas.hold(other, QuotaKind::kBytesInFlight, 60, kStart).ok()) << "the connection is full";
    EXPECT_TRUE(quotas.take("b", QuotaKind::kBytesInFlight, 100, kStart).ok()) << "and gave back what b had taken";
    hold->shrink(10);
    EXPECT_FALSE(quotas.take("a", QuotaKind::kBytesInFlight, 91, kStart).ok());
    const QuotaHold moved = *std::move(hold);
    EXPECT_FALSE(quotas.take("a", QuotaKind::kBytesInFlight, 91, kStart).ok());
  }
  EXPECT_TRUE(quotas.take("a", QuotaKind::kBytesInFlight, 100, kStart).ok());
  EXPECT_TRUE(quotas.take("connection:x", QuotaKind::kBytesInFlight, 100, kStart).ok());
}

TEST_F(QuotasTest, ARateIsTakenFromEachSubjectOrFromNone) {
  const std::vector<std::string> subjects = {"token:ci", "connection:1"};
  Quotas quotas(
      [](absl::string_view subject) { return quota(QuotaKind::kQueries, subject == "token:ci" ? 1000 : 10); });
  EXPECT_TRUE(quotas.take_each(subjects, QuotaKind::kQueries, 20, kStart).ok());
  EXPECT_FALSE(quotas.take_each(subjects, QuotaKind::kQueries, 1, kStart).ok()) << "the connection's quota is used up";
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 1981, kStart).ok());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 1980, kStart).ok()) << "the refusal took nothing";
}

TEST_F(QuotasTest, WhatIsCountedElsewhereIsInUseToo) {
  quota_ = quota(QuotaKind::kScenes, 3);
  Quotas quotas(source());
  const std::vector<std::string> subject = {"token:ci"};
  double registered = 2;
  const auto besides = [&] { return registered; };
  absl::StatusOr<QuotaHold> hold = quotas.hold(subject, QuotaKind::kScenes, 1, kStart, besides);
  ASSERT_TRUE(hold.ok());
  const absl::Status status = quotas.hold(subject, QuotaKind::kScenes, 1, kStart, besides).status();
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("quota scenes of token:ci is 3, asked for 1; 3 are in use; delete a scene"));
  registered = 1;
  EXPECT_TRUE(quotas.hold(subject, QuotaKind::kScenes, 1, kStart, besides).ok());
}

TEST_F(QuotasTest, WhatIsHeldAnywayCountsForTheNext) {
  quota_ = quota(QuotaKind::kBytesInFlight, 100);
  Quotas quotas(source());
  const std::vector<std::string> subject = {"token:ci"};
  {
    const QuotaHold hold = quotas.hold_anyway(subject, QuotaKind::kBytesInFlight, 500, kStart);
    EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kBytesInFlight, 1, kStart).ok());
  }
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kBytesInFlight, 100, kStart).ok());
}

TEST_F(QuotasTest, SubjectsAndKindsDoNotShareTheirQuotas) {
  quota_.limits.fill(5);
  quota_.burst_s = 1;
  Quotas quotas(source());
  for (size_t kind = 0; kind < kQuotaKinds; ++kind)
    for (const char* const subject : {"token:a", "token:b", "connection:ipv4:10.0.0.1:7"}) {
      EXPECT_TRUE(quotas.take(subject, static_cast<QuotaKind>(kind), 5, kStart).ok());
      EXPECT_FALSE(quotas.take(subject, static_cast<QuotaKind>(kind), 1, kStart).ok());
    }
}

TEST_F(QuotasTest, AChangedQuotaCountsAfterRefresh) {
  Quotas quotas(source());
  ASSERT_TRUE(quotas.take("token:ci", QuotaKind::kOpenStreams, 5, kStart).ok());
  ASSERT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 1e9, kStart).ok());
  quota_ = quota(QuotaKind::kQueries, 10);
  quota_.limits[static_cast<size_t>(QuotaKind::kOpenStreams)] = 5;
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 1e9, kStart).ok());
  quotas.refresh();
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 21, kStart).ok());
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 20, kStart).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kOpenStreams, 1, kStart).ok());
  quota_ = Quota();
  quotas.refresh();
  EXPECT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 1e9, kStart).ok());
}

TEST_F(QuotasTest, TimeThatRunsBackwardsGivesNothing) {
  quota_ = quota(QuotaKind::kQueries, 10);
  Quotas quotas(source());
  ASSERT_TRUE(quotas.take("token:ci", QuotaKind::kQueries, 20, kStart).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 1, kStart - kSecond).ok());
  EXPECT_FALSE(quotas.take("token:ci", QuotaKind::kQueries, 1, kStart).ok());
}

TEST_F(QuotasTest, AFullTableForgetsIdleSubjectsAndKeepsThoseInUse) {
  quota_ = quota(QuotaKind::kQueries, 10);
  Quotas quotas(source(), 4);
  ASSERT_TRUE(quotas.take("stream", QuotaKind::kOpenStreams, 1, kStart).ok());
  ASSERT_TRUE(quotas.take("busy", QuotaKind::kQueries, 20, kStart).ok());
  for (int i = 0; i < 100; ++i)
    ASSERT_TRUE(quotas.take(absl::StrCat("idle", i), QuotaKind::kQueries, 0, kStart).ok()) << i;
  EXPECT_FALSE(quotas.take("busy", QuotaKind::kQueries, 1, kStart).ok());
  std::vector<std::string> subjects;
  for (const SubjectUse& use : quotas.usage(kStart)) subjects.push_back(use.subject);
  EXPECT_EQ(subjects.size(), 4u);
  EXPECT_THAT(subjects, testing::IsSupersetOf({"stream", "busy"}));
  quotas.release("stream", QuotaKind::kOpenStreams, 1);
}

TEST_F(QuotasTest, ATableFullOfSubjectsInUseRefusesNewOnes) {
  Quotas quotas(source(), 3);
  for (const char* const subject : {"a", "b", "c"})
    ASSERT_TRUE(quotas.take(subject, QuotaKind::kOpenStreams, 1, kStart).ok());
  const absl::Status status = quotas.take("d", QuotaKind::kQueries, 1, kStart);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal_of(status)->limit, "quota_subjects");
  EXPECT_GT(refusal_of(status)->retry_after_ms, 0u);
  quotas.release("d", QuotaKind::kOpenStreams, 1);  // this stream was never taken
  quotas.forget("b");
  EXPECT_TRUE(quotas.take("d", QuotaKind::kQueries, 1, kStart).ok());
}

TEST_F(QuotasTest, UsageListsAmountsRatesAndWhatIsLeft) {
  quota_ = quota(QuotaKind::kQueries, 1000);
  quota_.limits[static_cast<size_t>(QuotaKind::kScenes)] = 8;
  Quotas quotas(source());
  ASSERT_TRUE(quotas.take("b", QuotaKind::kScenes, 3, kStart).ok());
  for (uint64_t i = 0; i <= 10; ++i)
    ASSERT_TRUE(quotas.take("a", QuotaKind::kQueries, 50, kStart + i * 100 * kMillisecond).ok());
  const std::vector<SubjectUse> usage = quotas.usage(kStart + kSecond);
  ASSERT_EQ(usage.size(), 2u);
  EXPECT_EQ(usage[0].subject, "a");
  EXPECT_EQ(usage[1].subject, "b");
  const QuotaUse& scenes = usage[1].quotas[static_cast<size_t>(QuotaKind::kScenes)];
  EXPECT_EQ(scenes.used, 3);
  EXPECT_EQ(scenes.limit, 8);
  EXPECT_EQ(scenes.available, 5);
  const QuotaUse& queries = usage[0].quotas[static_cast<size_t>(QuotaKind::kQueries)];
  EXPECT_NEAR(queries.used, 500, 1);  // ten takes of 50 in the first second
  EXPECT_EQ(queries.limit, 1000);
  EXPECT_EQ(usage[0].quotas[static_cast<size_t>(QuotaKind::kWork)].limit, kNoQuota);
}

// For any sequence of requests, at most rate * (t + burst in seconds) queries are granted in the first t seconds, and
// the number of objects in use never exceeds the quota of objects.
TEST_F(QuotasTest, RandomUseNeverExceedsTheQuota) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    test::Random random(seed);
    quota_ = quota(QuotaKind::kQueries, random.between(1, 1e4), random.between(0.1, 4));
    quota_.limits[static_cast<size_t>(QuotaKind::kObjects)] = random.between(1, 1e4);
    Quotas quotas(source());
    double granted = 0, in_use = 0;
    uint64_t now = kStart;
    for (uint64_t i = 0; i < test::scaled_count(5000); ++i) {
      now += random.below(50 * kMillisecond);
      const double asked = random.magnitude(0, 12);
      if (quotas.take("a", QuotaKind::kQueries, asked, now).ok()) granted += asked;
      if (quotas.take("a", QuotaKind::kObjects, asked, now).ok()) in_use += asked;
      const double seconds = static_cast<double>(now - kStart) / kSecond;
      ASSERT_LE(granted, quota_.of(QuotaKind::kQueries) * (quota_.burst_s + seconds) * (1 + 1e-9)) << "seed " << seed;
      ASSERT_LE(in_use, quota_.of(QuotaKind::kObjects)) << "seed " << seed;
      if (random.chance(0.3)) {
        const double part = in_use * random.unit();
        quotas.release("a", QuotaKind::kObjects, part);
        in_use -= part;
      }
    }
  }
}

TEST_F(QuotasTest, ThreadsTogetherGetNoMoreThanTheQuota) {
  quota_ = quota(QuotaKind::kQueries, 1000);
  quota_.limits[static_cast<size_t>(QuotaKind::kOpenStreams)] = 3;
  Quotas quotas(source(), 100);
  std::atomic<uint64_t> granted{0};
  std::atomic<int> open{0}, max_open{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 2000; ++i) {
        if (quotas.take("token:ci", QuotaKind::kQueries, 1, kStart).ok()) granted.fetch_add(1);
        if (quotas.take("token:ci", QuotaKind::kOpenStreams, 1, kStart).ok()) {
          const int now = open.fetch_add(1) + 1;
          if (now > 3) max_open.store(now);
          open.fetch_sub(1);
          quotas.release("token:ci", QuotaKind::kOpenStreams, 1);
        }
        const std::string connection = absl::StrCat("connection:", t, ":", i % 50);
        quotas.charge(connection, QuotaKind::kWork, 1, kStart);
        if (i % 50 == 0) quotas.refresh();
        if (i % 100 == 0) (void)quotas.usage(kStart);
        if (i % 7 == 0) quotas.forget(connection);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(granted.load(), 2000u);
  EXPECT_EQ(max_open.load(), 0);
}

}  // namespace
}  // namespace locus::server
