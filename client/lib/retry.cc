#include "client/lib/retry.h"

#include <algorithm>
#include <random>

#include "absl/time/clock.h"
#include "client/lib/status.h"

namespace locus::client {
namespace {

constexpr int kMaxDoublings = 20;

double jitter() {
  thread_local std::minstd_rand generator{std::random_device{}()};
  return std::uniform_real_distribution<double>(0.8, 1.2)(generator);
}

}  // namespace

std::optional<absl::Duration> Backoff::after_failure(const absl::Status& failure) {
  if (++failures_ >= policy_.max_attempts) return std::nullopt;
  const absl::Duration wait = policy_.first_backoff * (int64_t{1} << std::min(failures_ - 1, kMaxDoublings));
  return std::max(std::min(wait, policy_.max_backoff) * jitter(), retry_after(failure));
}

bool worth_repeating(const absl::Status& failure) {
  if (absl::IsUnavailable(failure)) return true;
  return absl::IsResourceExhausted(failure) && retry_after(failure) > absl::ZeroDuration();
}

absl::Status with_retries(const RetryPolicy& policy, absl::Time deadline, const std::function<absl::Status()>& attempt,
                          const std::function<void(absl::Duration)>& wait) {
  Backoff backoff(policy);
  while (true) {
    const absl::Status status = attempt();
    if (status.ok() || !worth_repeating(status)) return status;
    const std::optional<absl::Duration> pause = backoff.after_failure(status);
    if (!pause || absl::Now() + *pause >= deadline) return status;
    wait(*pause);
  }
}

}  // namespace locus::client
