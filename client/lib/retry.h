// Retries of calls that are safe to repeat. Internal to the library: callers configure retries with RetryPolicy.
#ifndef LOCUS_CLIENT_LIB_RETRY_H_
#define LOCUS_CLIENT_LIB_RETRY_H_

#include <functional>
#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client/lib/options.h"

namespace locus::client {

// Sequence of the waits between the attempts of one call. Not thread-safe.
class Backoff {
 public:
  explicit Backoff(const RetryPolicy& policy) : policy_(policy) {}

  // Counts a failure. Returns the wait before the next attempt; this wait is at least the wait that the server
  // requested. Returns nothing if all attempts that the policy allows are used up.
  std::optional<absl::Duration> after_failure(const absl::Status& failure);
  // Resets the count of failures after a success, so that the wait after the next failure is first_backoff again.
  void reset() { failures_ = 0; }

 private:
  RetryPolicy policy_;
  int failures_ = 0;
};

// Returns whether a call that is safe to repeat should be repeated: after UNAVAILABLE, and after RESOURCE_EXHAUSTED if
// the server requested a wait before the retry.
bool worth_repeating(const absl::Status& failure);

// Calls `attempt` until it succeeds or fails with an error that is not worth repeating, until the attempts of the
// policy are used up, or until the next wait would reach `deadline`. Returns the last outcome. Calls `wait` for
// each wait, in the caller's thread.
absl::Status with_retries(const RetryPolicy& policy, absl::Time deadline, const std::function<absl::Status()>& attempt,
                          const std::function<void(absl::Duration)>& wait);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_RETRY_H_
