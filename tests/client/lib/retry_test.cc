#include "client/lib/retry.h"

#include <gtest/gtest.h>

#include "absl/time/clock.h"
#include "client/lib/status.h"

namespace locus::client {
namespace {

constexpr RetryPolicy kQuick = {
    .max_attempts = 3, .first_backoff = absl::Milliseconds(1), .max_backoff = absl::Milliseconds(4)};

absl::Status exhausted(uint32_t retry_after_ms) {
  v1::Error error;
  error.set_code(static_cast<int>(absl::StatusCode::kResourceExhausted));
  error.set_reason(v1::REASON_LIMIT);
  error.set_retry_after_ms(retry_after_ms);
  return to_absl_status(error);
}

TEST(BackoffTest, WaitsDoubleUpToTheMaximumUntilTheAttemptsAreUsedUp) {
  Backoff backoff(
      {.max_attempts = 4, .first_backoff = absl::Milliseconds(100), .max_backoff = absl::Milliseconds(150)});
  const absl::Status failure = absl::UnavailableError("");
  for (const double longest : {100.0, 150.0, 150.0}) {
    const std::optional<absl::Duration> wait = backoff.after_failure(failure);
    ASSERT_TRUE(wait.has_value());
    EXPECT_GE(*wait, absl::Milliseconds(longest * 0.8));
    EXPECT_LE(*wait, absl::Milliseconds(longest * 1.2));
  }
  EXPECT_FALSE(backoff.after_failure(failure).has_value());
  backoff.reset();
  EXPECT_TRUE(backoff.after_failure(failure).has_value());
}

TEST(BackoffTest, TheServersHintIsAMinimum) {
  Backoff backoff(kQuick);
  EXPECT_EQ(backoff.after_failure(exhausted(700)), absl::Milliseconds(700));
}

TEST(RetriesTest, UnavailableIsRetriedUntilTheAttemptsAreUsedUp) {
  int calls = 0;
  const absl::Status status = with_retries(
      kQuick, absl::Now() + absl::Minutes(1),
      [&] {
        ++calls;
        return absl::UnavailableError("down");
      },
      absl::SleepFor);
  EXPECT_TRUE(absl::IsUnavailable(status));
  EXPECT_EQ(calls, 3);
}

TEST(RetriesTest, SuccessEndsTheRetries) {
  int calls = 0;
  const absl::Status status = with_retries(
      kQuick, absl::Now() + absl::Minutes(1),
      [&] { return ++calls < 2 ? absl::UnavailableError("down") : absl::OkStatus(); }, absl::SleepFor);
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(calls, 2);
}

TEST(RetriesTest, ResourceExhaustedIsRetriedOnlyWithAHint) {
  EXPECT_TRUE(worth_repeating(exhausted(5)));
  EXPECT_FALSE(worth_repeating(exhausted(0)));
  EXPECT_FALSE(worth_repeating(absl::InternalError("")));
  EXPECT_FALSE(worth_repeating(absl::DeadlineExceededError("")));
}

TEST(RetriesTest, AWaitBeyondTheDeadlineIsNotStarted) {
  int calls = 0;
  const absl::Status status = with_retries(
      kQuick, absl::Now() + absl::Seconds(5),
      [&] {
        ++calls;
        return exhausted(60'000);
      },
      absl::SleepFor);
  EXPECT_TRUE(absl::IsResourceExhausted(status));
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace locus::client
