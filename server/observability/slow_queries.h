// The line that is logged for a batch of queries that took long, and how often: at most kMaxSlowQueryLines a second,
// since a slow server is the last that should write more. Those left out are counted, and the next line says how many.
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
  std::string kinds;  // of the blocks, such as ray,ball
  uint64_t revision = 0;
  uint64_t queries = 0;
  uint64_t nanoseconds = 0;       // from the batch's turn to its answer
  uint64_t work_nanoseconds = 0;  // of processor time, all threads together
  Work work;
};

class SlowQueries {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // 0 = none is slow.
  explicit SlowQueries(uint32_t milliseconds)
      : nanoseconds_(milliseconds == 0 ? std::numeric_limits<uint64_t>::max() : uint64_t{milliseconds} * 1'000'000) {}

  bool is_slow(uint64_t nanoseconds) const { return nanoseconds >= nanoseconds_; }

  // Counts it, and logs a warning unless there were too many within a second of `now`.
  void record(const SlowQuery& query, Time now) LOCUS_EXCLUDES(mutex_);

  uint64_t count() const { return count_.load(); }

 private:
  const uint64_t nanoseconds_;
  std::atomic<uint64_t> count_{0};
  Mutex mutex_;
  Time second_ LOCUS_GUARDED_BY(mutex_){};  // when the second began that lines are counted in
  uint32_t lines_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t left_out_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_SLOW_QUERIES_H_
