// Log lines for slow query batches: at most kMaxSlowQueryLines a second, so that logging does not slow an overloaded
// server further. Omitted lines are counted, and the next line reports how many lines were omitted.
//
// Threads: every member may be called from any thread. is_slow() is one comparison.
#ifndef LOCUS_SERVER_OBSERVABILITY_SLOW_QUERIES_H_
#define LOCUS_SERVER_OBSERVABILITY_SLOW_QUERIES_H_

#include <atomic>
#include <cstdint>
#include <limits>
#include <string>

#include "absl/strings/string_view.h"
#include "core/index/work.h"
#include "server/config/observability_limits.h"
#include "server/observability/line_limit.h"

namespace locus::server {

struct SlowQuery {
  absl::string_view rpc;
  std::string scene;
  std::string kinds;  // kinds of the batch's blocks, such as ray,ball
  uint64_t revision = 0;
  uint64_t queries = 0;
  uint64_t nanoseconds = 0;       // elapsed time from the availability of the revision to the answer
  uint64_t work_nanoseconds = 0;  // processor time of all threads together
  Work work;
};

class SlowQueries {
 public:
  using Time = LineLimit::Time;

  // Sets the minimum duration in milliseconds of a slow batch; 0 = no batch is slow.
  explicit SlowQueries(uint32_t milliseconds)
      : nanoseconds_(milliseconds == 0 ? std::numeric_limits<uint64_t>::max() : uint64_t{milliseconds} * 1'000'000) {}

  bool is_slow(uint64_t nanoseconds) const { return nanoseconds >= nanoseconds_; }

  // Counts the batch as slow. Logs a warning, unless kMaxSlowQueryLines lines were logged within the current second.
  void record(const SlowQuery& query, Time now);

  uint64_t count() const { return count_.load(); }

 private:
  const uint64_t nanoseconds_;
  std::atomic<uint64_t> count_{0};
  LineLimit lines_{kMaxSlowQueryLines};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_SLOW_QUERIES_H_
