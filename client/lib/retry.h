// Trying again what may be tried again. Internal to the library: callers choose by RetryPolicy and by what they call.
#ifndef LOCUS_CLIENT_LIB_RETRY_H_
#define LOCUS_CLIENT_LIB_RETRY_H_

#include <functional>
#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client/lib/options.h"

namespace locus::client {

// The waits of one sequence of tries. Not thread-safe.
class Backoff {
 public:
  explicit Backoff(const RetryPolicy& policy) : policy_(policy) {}

  // Counts a failure. The wait before the next try, never shorter than the server's hint; nothing when the policy's
  // tries are used up.
  std::optional<absl::Duration> after_failure(const absl::Status& failure);
  // After a success: the next failure starts from the shortest wait.
  void reset() { failures_ = 0; }

 private:
  RetryPolicy policy_;
  int failures_ = 0;
};

// UNAVAILABLE always; RESOURCE_EXHAUSTED if the server names a wait. Meant for calls that are safe to repeat.
bool worth_repeating(const absl::Status& failure);

// Calls `attempt` until it succeeds, fails for good, the policy's tries are used up, or the next wait would not end
// before `deadline`; returns the last outcome. Sleeps in the caller's thread.
absl::Status with_retries(const RetryPolicy& policy, absl::Time deadline, const std::function<absl::Status()>& attempt);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_RETRY_H_
