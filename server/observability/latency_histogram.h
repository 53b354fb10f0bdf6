// Histogram of durations. It has two ranges between any two consecutive powers of two, from 2^10 ns (a microsecond) to
// 2^34 ns (17 s), so a quantile that is computed from the histogram has a relative error below one half.
//
// Threads: any thread may call any member at any time. record() costs two relaxed additions, without a lock or an
// allocation.
#ifndef LOCUS_SERVER_OBSERVABILITY_LATENCY_HISTOGRAM_H_
#define LOCUS_SERVER_OBSERVABILITY_LATENCY_HISTOGRAM_H_

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/base/check.h"

namespace locus::server {

inline constexpr uint32_t kLowestOctave = 10;   // 2^10 ns, a microsecond
inline constexpr uint32_t kHighestOctave = 34;  // 2^34 ns, 17 s
// Number of ranges that have an upper bound. One more range has no upper bound.
inline constexpr size_t kLatencyBounds = 2 * (kHighestOctave - kLowestOctave) + 1;

// Returns the upper bound of a range, in nanoseconds: 2^10 for range 0, 1.5 * 2^10 for range 1, 2^11 for range 2 and so
// on. Precondition: `range` < kLatencyBounds.
constexpr uint64_t latency_bound(size_t range) {
  LOCUS_DCHECK_LT(range, kLatencyBounds);
  const uint64_t octave = uint64_t{1} << (kLowestOctave + range / 2);
  return range % 2 == 0 ? octave : octave + octave / 2;
}

// Returns the range of a duration: the first range whose latency_bound() is not below the duration, or kLatencyBounds
// if there is no such range.
constexpr size_t latency_range(uint64_t nanoseconds) {
  if (nanoseconds <= latency_bound(0)) return 0;
  const uint64_t below = nanoseconds - 1;  // a duration equal to a bound belongs to the range below that bound
  const auto octave = static_cast<uint32_t>(std::bit_width(below)) - 1;
  const size_t half = below >> (octave - 1) & 1;
  return std::min<size_t>(kLatencyBounds, size_t{2} * (octave - kLowestOctave) + half + 1);
}

// Counts of one histogram, or sums over several histograms: the number of durations in each range, and the sum of all
// durations in nanoseconds.
struct LatencyCounts {
  std::array<uint64_t, kLatencyBounds + 1> ranges{};
  uint64_t nanoseconds = 0;

  uint64_t count() const {
    uint64_t sum = 0;
    for (const uint64_t range : ranges) sum += range;
    return sum;
  }
};

class LatencyHistogram {
 public:
  void record(uint64_t nanoseconds) {
    nanoseconds_.fetch_add(nanoseconds, std::memory_order_relaxed);
    ranges_[latency_range(nanoseconds)].fetch_add(1, std::memory_order_relaxed);
  }

  void add_to(LatencyCounts& counts) const {
    for (size_t i = 0; i < ranges_.size(); ++i) counts.ranges[i] += ranges_[i].load(std::memory_order_relaxed);
    counts.nanoseconds += nanoseconds_.load(std::memory_order_relaxed);
  }

 private:
  std::array<std::atomic<uint64_t>, kLatencyBounds + 1> ranges_{};
  std::atomic<uint64_t> nanoseconds_{0};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_LATENCY_HISTOGRAM_H_
