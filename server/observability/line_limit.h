// Limits how many log lines a second one kind of event causes, so that a flood of events does not become a flood of
// lines. Threads: every member may be called from any thread.
#ifndef LOCUS_SERVER_OBSERVABILITY_LINE_LIMIT_H_
#define LOCUS_SERVER_OBSERVABILITY_LINE_LIMIT_H_

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/mutex.h"

namespace locus::server {

class LineLimit {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit LineLimit(uint32_t lines_per_second) : max_(lines_per_second) {}

  // If a line may be written now, returns the number of lines that were left out since the last written line. Otherwise
  // counts the line as left out and returns nullopt.
  std::optional<uint64_t> admit(Time now) LOCUS_EXCLUDES(mutex_) {
    const MutexLock lock(mutex_);
    if (now - second_ >= std::chrono::seconds(1)) {
      second_ = now;
      lines_ = 0;
    }
    if (lines_ >= max_) {
      ++left_out_;
      return std::nullopt;
    }
    ++lines_;
    return std::exchange(left_out_, 0);
  }

 private:
  const uint32_t max_;
  Mutex mutex_;
  Time second_ LOCUS_GUARDED_BY(mutex_){};  // start of the second in which `lines_` are counted
  uint32_t lines_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t left_out_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_LINE_LIMIT_H_
