// The best hits of one ray so far, and how near the next one must be. One thread at a time.
#ifndef LOCUS_CORE_QUERY_KINDS_HIT_COLLECTOR_H_
#define LOCUS_CORE_QUERY_KINDS_HIT_COLLECTOR_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/geometry/float_step.h"
#include "core/geometry/ray.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

// The best hits so far, and how near the next one must be.
class HitCollector {
 public:
  explicit HitCollector(const RayRequest& request)
      : mode_(request.mode),
        // One more than wanted tells, whatever the order of visiting, whether there were more.
        capacity_(request.mode == RayMode::kAll ? size_t{request.max_results} + 1 : 1),
        limit_(request.t_max) {}

  // Nothing beyond it is wanted; a hit exactly there may be, if its id is lower.
  float limit() const { return limit_; }

  // False when no further hit matters.
  bool offer(const Hit& hit) {
    if (!(hit.t <= limit_)) return true;
    if (answer_.hits.size() == capacity_) {
      if (!nearer(hit, answer_.hits.front())) return true;
      std::pop_heap(answer_.hits.begin(), answer_.hits.end(), nearer);
      answer_.hits.pop_back();
    }
    answer_.hits.push_back(hit);
    if (answer_.hits.size() == capacity_) {
      // The farthest first: what comes next may push it out.
      if (is_heap_)
        std::push_heap(answer_.hits.begin(), answer_.hits.end(), nearer);
      else
        std::make_heap(answer_.hits.begin(), answer_.hits.end(), nearer);
      is_heap_ = true;
      limit_ = answer_.hits.front().t;
    }
    return mode_ != RayMode::kAny;
  }

  bool done() const { return mode_ == RayMode::kAny && !answer_.hits.empty(); }

  RayAnswer finish() {
    std::sort(answer_.hits.begin(), answer_.hits.end(), nearer);
    answer_.truncated = mode_ == RayMode::kAll && answer_.hits.size() == capacity_;
    if (answer_.truncated) answer_.hits.pop_back();
    return std::move(answer_);
  }

 private:
  const RayMode mode_;
  const size_t capacity_;
  float limit_;
  bool is_heap_ = false;  // once there are as many hits as kept at most
  RayAnswer answer_;
};

// As a finite float, rounded once; the sum turns -0 into 0, so that equal answers have equal bytes.
inline float rounded_distance(double t) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::min(t, kLargest)) + 0.0f;
}

// Where a ray enters bounds, 0 from inside. Nothing where it passes them.
inline std::optional<float> entry(const SlabRay<double>& slabs, const Aabbd& bounds) {
  const Interval<double> interval = slabs.interval(bounds);
  if (!(interval.near <= interval.far) || interval.far < 0) return std::nullopt;
  return rounded_distance(std::max(interval.near, 0.0));
}

// Distances of the double slab test that would round down to `limit` as a float are not beyond it.
inline double raised(float limit) { return double{next_above(limit)}; }

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_HIT_COLLECTOR_H_
