// Collector of the best hits of one ray or sweep. limit() is the largest t at which a hit may still be retained. This
// limit decreases as hits are found, so that ray searches skip everything beyond the limit. A collector belongs to one
// thread.
#ifndef LOCUS_CORE_QUERY_KINDS_HIT_COLLECTOR_H_
#define LOCUS_CORE_QUERY_KINDS_HIT_COLLECTOR_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/base/check.h"
#include "core/geometry/float_step.h"
#include "core/geometry/ray.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

// Bounded set of the first hits in the order of nearer(). Invariants: the collector has at most capacity_ hits. Once
// the collector has capacity_ hits, the hits form a heap whose front is the last hit in the order of nearer(), and
// limit_ is the t of the front. limit_ never increases. With count_only, the collector only counts hits.
class HitCollector {
 public:
  explicit HitCollector(const RayRequest& request)
      : HitCollector(request.mode, request.max_results, request.t_max, request.count_only, request.after) {}
  // `count_only` needs the mode kAll. Hits that do not follow `after` in the order of rows are ignored.
  HitCollector(RayMode mode, uint32_t max_results, float t_max, bool count_only, const RowPosition& after)
      : mode_(mode),
        count_only_(count_only),
        // Retains one more hit than requested: the answer is truncated if this additional hit exists. The order in
        // which hits are found therefore does not matter.
        capacity_(mode == RayMode::kAll ? size_t{max_results} + 1 : 1),
        limit_(t_max) {
    // Copies `after` only if it is given, which is rare: copying a value that was just written in parts would stall
    // the processor.
    if (after.is_given()) after_ = after;
  }

  // Returns the largest t at which a hit may still be retained. Once the collector is full, a hit at exactly this t is
  // retained only if it precedes the last retained hit in the order of nearer().
  float limit() const { return limit_; }

  // Adds `hit` if it is among the first capacity_ hits so far in the order of nearer(). Returns false for a kAny ray if
  // `hit` was added: one hit is enough, so the search can stop.
  bool offer(const Hit& hit) {
    LOCUS_DCHECK_NE(hit.id, kNoId);
    LOCUS_DCHECK(!(hit.t < 0));
    if (!(hit.t <= limit_) || !after_.is_before(hit)) return true;
    if (count_only_) {
      ++answer_.count;
      return true;
    }
    if (answer_.hits.size() == capacity_) {
      if (!nearer(hit, answer_.hits.front())) return true;
      std::pop_heap(answer_.hits.begin(), answer_.hits.end(), nearer);
      answer_.hits.pop_back();
    }
    answer_.hits.push_back(hit);
    if (answer_.hits.size() == capacity_) {
      // Makes the last hit in the order of nearer() the front of the heap, where the next better hit replaces it.
      if (is_heap_)
        std::push_heap(answer_.hits.begin(), answer_.hits.end(), nearer);
      else
        std::make_heap(answer_.hits.begin(), answer_.hits.end(), nearer);
      is_heap_ = true;
      LOCUS_DCHECK_LE(answer_.hits.front().t, limit_);
      limit_ = answer_.hits.front().t;
    }
    LOCUS_DCHECK_CALL(check_invariants());
    return mode_ != RayMode::kAny;
  }

  // Returns true if the search can stop because the mode is kAny and a hit was found.
  bool done() const { return mode_ == RayMode::kAny && !answer_.hits.empty(); }

  // Returns the hits in the order of nearer(), at most the requested number. Empties the collector; call it once.
  RayAnswer finish() {
    LOCUS_DCHECK_CALL(check_invariants());
    if (answer_.hits.size() > 1) std::sort(answer_.hits.begin(), answer_.hits.end(), nearer);
    answer_.truncated = mode_ == RayMode::kAll && answer_.hits.size() == capacity_;
    if (answer_.truncated) answer_.hits.pop_back();
    return std::move(answer_);
  }

 private:
  void check_invariants() const {
    const auto& hits = answer_.hits;
    LOCUS_DCHECK_LE(hits.size(), capacity_);
    LOCUS_DCHECK_EQ(is_heap_, hits.size() == capacity_);
    if (!is_heap_) return;
    LOCUS_DCHECK_EQ(limit_, hits.front().t);
    // Checks only the children of the front and the last element: checking the whole heap would cost more than
    // offer() itself.
    for (const size_t child : {size_t{1}, size_t{2}, hits.size() - 1})
      if (child < hits.size()) LOCUS_DCHECK(!nearer(hits.front(), hits[child]));
  }

  const RayMode mode_;
  const bool count_only_;
  RowPosition after_;
  const size_t capacity_;
  float limit_;
  bool is_heap_ = false;  // true once answer_.hits has capacity_ elements
  RayAnswer answer_;
};

// Returns `t` rounded to float, but at most the largest finite float. Adding 0 turns -0 into 0, so that equal results
// have equal bytes.
inline float rounded_distance(double t) {
  constexpr double kMaxFloat = std::numeric_limits<float>::max();
  return static_cast<float>(std::min(t, kMaxFloat)) + 0.0f;
}

// Returns the t at which a ray enters `bounds`, 0 if the ray starts inside `bounds`, or nullopt if the ray misses
// `bounds`.
inline std::optional<float> entry(const SlabRay<double>& slabs, const Aabbd& bounds) {
  const Interval<double> interval = slabs.interval(bounds);
  if (!(interval.near <= interval.far) || interval.far < 0) return std::nullopt;
  return rounded_distance(std::max(interval.near, 0.0));
}

// Returns `limit` as a double, raised to the next float: every double that rounds to a float of at most `limit` is
// below the result.
inline double raised(float limit) { return double{next_above(limit)}; }

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_HIT_COLLECTOR_H_
