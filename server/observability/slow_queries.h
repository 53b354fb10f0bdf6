// Log lines for slow query batches: at most kMaxSlowQueryLines a second, so that logging does not slow an overloaded
// server further. Omitted lines are counted, and the next line reports how many there were.
//
// Threads: every member may be called from any thread. is_slow() is one comparison.
#ifndef LOCUS_SERVER_OBSERVABILITY_SLOW_QUERIES_H_
#define LOCUS_SERVER_OBSERVABILITY_SLOW_QUERIES_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <string>

#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "core/index/work.h"

namespace locus::server {

struct SlowQuery {
  absl::string_view rpc;
  std::string scene;
  std::string kinds;  // kinds of the batch's blocks, such as ray,ball
  uint64_t revision = 0;
  uint64_t queries = 0;
  uint64_t nanoseconds = 0;       // elapsed time from when the revision was available to the answer
  uint64_t work_nanoseconds = 0;  // processor time of all threads together
  Work work;
};

class SlowQueries {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Sets the duration in milliseconds from which on a batch is slow; 0 = no batch is slow.
  explicit SlowQueries(uint32_t milliseconds)
      : nanoseconds_(milliseconds == 0 ? std::numeric_limits<uint64_t>::max() : uint64_t{milliseconds} * 1'000'000) {}

  bool is_slow(uint64_t nanoseconds) const { return nanoseconds >= nanoseconds_; }

  // Counts the batch, and logs a warning unless kMaxSlowQueryLines were logged within the current second.
  void record(const SlowQuery& query, Time now) LOCUS_EXCLUDES(mutex_);

  uint64_t count() const { return count_.load(); }

 private:
  const uint64_t nanoseconds_;
  std::atomic<uint64_t> count_{0};
  Mutex mutex_;
  Time second_ LOCUS_GUARDED_BY(mutex_){};  // start of the second in which `lines_` are counted
  uint32_t lines_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t left_out_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_SLOW_QUERIES_H_
