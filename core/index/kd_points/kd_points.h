// Points in one to four dimensions, with queries by boxes, balls and the nearest points. For points that are not places
// in a scene: times (one dimension), moving places with time as an axis (four), colours (three), grades of many kinds.
// The coordinates have any unit; a ball and the nearest points are those by the Euclidean distance.
//
// The points are kept in one array: the median of a range of points divides the range into two halves, on the axis on
// which the range extends most. The array needs no nodes; one byte for each point keeps its axis.
//
// Threads: immutable after build(); every member may run concurrently.
// Invariant: among the points of a range that is divided, those before the median are not above it on its axis, and
// those after it are not below it.
// Source: Bentley, Multidimensional Binary Search Trees Used for Associative Searching, 1975; Friedman, Bentley,
// Finkel, An Algorithm for Finding Best Matches in Logarithmic Expected Time, 1977 (median, widest axis, nearest
// points).
#ifndef LOCUS_CORE_INDEX_KD_POINTS_KD_POINTS_H_
#define LOCUS_CORE_INDEX_KD_POINTS_KD_POINTS_H_

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/index/work.h"

namespace locus {

// A point and the number by which the caller knows it. Ids need not be unique.
template <std::floating_point S, size_t K>
struct KdPoint {
  std::array<S, K> position;
  uint64_t id = 0;

  friend bool operator==(const KdPoint&, const KdPoint&) = default;
};

// A point and its squared distance from the point of a query, in double. Ordered by distance, then by id.
template <std::floating_point S, size_t K>
struct KdPointAt {
  double squared_distance;
  KdPoint<S, K> point;

  friend bool operator<(const KdPointAt& a, const KdPointAt& b) {
    if (a.squared_distance != b.squared_distance) return a.squared_distance < b.squared_distance;
    return a.point.id < b.point.id;
  }
};

// Returns the squared distance between two points: the sum, in double and in the order of the axes, of the squared
// differences of their coordinates.
template <std::floating_point S, size_t K>
double squared_distance(const std::array<S, K>& a, const std::array<S, K>& b) {
  double sum = 0;
  for (size_t axis = 0; axis < K; ++axis) {
    const double difference = double{a[axis]} - double{b[axis]};
    sum += difference * difference;
  }
  return sum;
}

template <std::floating_point S, size_t K>
class KdPoints {
  static_assert(1 <= K && K <= 4);

 public:
  using Position = std::array<S, K>;
  using Point = KdPoint<S, K>;
  using PointAt = KdPointAt<S, K>;

  // Makes an index without points.
  KdPoints() = default;

  // Builds the index. Precondition: no coordinate is NaN. O(n log n).
  static KdPoints build(std::vector<Point> points) {
    LOCUS_CHECK_LE(points.size(), size_t{limits::kMaxBvhValues});
    KdPoints result;
    result.points_ = std::move(points);
    result.axes_.resize(result.points_.size());
    Ranges pending = {{0, result.points_.size()}};
    while (!pending.empty()) {
      const Range range = pending.back();
      pending.pop_back();
      if (range.end - range.begin <= kLeafPoints) continue;
      result.divide(range);
      pending.push_back({range.middle() + 1, range.end});
      pending.push_back({range.begin, range.middle()});
    }
    LOCUS_DCHECK_CALL(result.check_invariants());
    return result;
  }

  size_t size() const { return points_.size(); }
  // All points in storage order.
  absl::Span<const Point> points() const { return points_; }

  // Calls fn(point) for each point in the closed box from `min` to `max`, in storage order, until fn returns false.
  // O(n^(1 - 1/K) + points found).
  template <class Fn>
  void visit_box(const Position& min, const Position& max, const Fn& fn, Work& work) const {
    const auto inside = [&](const Position& position) {
      for (size_t axis = 0; axis < K; ++axis)
        if (!(min[axis] <= position[axis] && position[axis] <= max[axis])) return false;
      return true;
    };
    Ranges pending;
    push(pending, {0, points_.size()});
    const auto test = [&](size_t i) {
      ++work.cells;
      if (!inside(points_[i].position)) return true;
      ++work.tests;
      return fn(points_[i]);
    };
    while (!pending.empty()) {
      const Range range = pending.back();
      pending.pop_back();
      ++work.nodes;
      if (range.end - range.begin <= kLeafPoints) {
        if (!test_all(range, test)) return;
        continue;
      }
      const size_t middle = range.middle(), axis = axes_[middle];
      const S plane = points_[middle].position[axis];
      if (!test(middle)) return;
      if (max[axis] >= plane) push(pending, {middle + 1, range.end});
      if (planted(PlantedBug::kKdPointsStrict) ? min[axis] < plane : min[axis] <= plane)
        push(pending, {range.begin, middle});
    }
  }

  // Calls fn(point) for each point whose squared_distance() from `center` is at most radius * radius in double, in
  // storage order, until fn returns false. `radius` must not be negative.
  template <class Fn>
  void visit_ball(const Position& center, double radius, const Fn& fn, Work& work) const {
    LOCUS_DCHECK_GE(radius, 0.0);
    Ranges pending;
    push(pending, {0, points_.size()});
    const double limit = radius * radius;
    // A plane farther than the limit on its axis alone has no point of the ball behind it: rounding is monotone.
    const auto reaches = [&](double gap) {
      return planted(PlantedBug::kKdPointsStrict) ? gap * gap < limit : gap * gap <= limit;
    };
    while (!pending.empty()) {
      const Range range = pending.back();
      pending.pop_back();
      ++work.nodes;
      const auto test = [&](size_t i) {
        ++work.cells;
        if (!(squared_distance(points_[i].position, center) <= limit)) return true;
        ++work.tests;
        return fn(points_[i]);
      };
      if (range.end - range.begin <= kLeafPoints) {
        if (!test_all(range, test)) return;
        continue;
      }
      const size_t middle = range.middle(), axis = axes_[middle];
      if (!test(middle)) return;
      const double offset = double{center[axis]} - double{points_[middle].position[axis]};
      if (offset >= 0 || reaches(offset)) push(pending, {middle + 1, range.end});
      if (offset <= 0 || reaches(offset)) push(pending, {range.begin, middle});
    }
  }

  // Appends the `count` points nearest to `center` with a squared_distance() of at most max_distance * max_distance, in
  // order of distance, then id. Of points with equal distances and ids, any may be left out.
  void nearest(const Position& center, double max_distance, size_t count, std::vector<PointAt>& result,
               Work& work) const {
    if (count == 0) return;
    std::vector<PointAt> heap;  // its top is the farthest point
    double limit = max_distance * max_distance;
    struct Pending {
      Range range;
      double squared_gap;  // lower bound of the squared distances in the range
    };
    absl::InlinedVector<Pending, kStack> pending;
    if (!points_.empty()) pending.push_back({{0, points_.size()}, 0});
    const auto test = [&](size_t i) {
      ++work.cells;
      const PointAt found = {squared_distance(points_[i].position, center), points_[i]};
      if (!(found.squared_distance <= limit)) return true;
      ++work.tests;
      if (heap.size() == count) {
        if (!(found < heap.front())) return true;
        std::pop_heap(heap.begin(), heap.end());
        heap.pop_back();
      }
      heap.push_back(found);
      std::push_heap(heap.begin(), heap.end());
      if (heap.size() == count) limit = heap.front().squared_distance;
      return true;
    };
    while (!pending.empty()) {
      const Pending now = pending.back();
      pending.pop_back();
      if (now.squared_gap > limit) continue;
      ++work.nodes;
      const Range range = now.range;
      if (range.end - range.begin <= kLeafPoints) {
        test_all(range, test);
        continue;
      }
      const size_t middle = range.middle(), axis = axes_[middle];
      test(middle);
      const double offset = double{center[axis]} - double{points_[middle].position[axis]};
      const Range below = {range.begin, middle}, above = {middle + 1, range.end};
      const double far_gap = std::max(now.squared_gap, offset * offset);
      pending.push_back({offset > 0 ? below : above, far_gap});
      pending.push_back({offset > 0 ? above : below, now.squared_gap});
    }
    std::sort_heap(heap.begin(), heap.end());
    result.insert(result.end(), heap.begin(), heap.end());
  }

 private:
  static constexpr size_t kLeafPoints = 8;
  static constexpr size_t kStack = 40;  // ranges halve, so that fewer than 40 are pending

  struct Range {
    size_t begin, end;
    size_t middle() const { return begin + (end - begin) / 2; }
  };
  using Ranges = absl::InlinedVector<Range, kStack>;

  static void push(Ranges& pending, Range range) {
    if (range.begin < range.end) pending.push_back(range);
  }

  template <class Test>
  static bool test_all(Range range, const Test& test) {
    for (size_t i = range.begin; i < range.end; ++i)
      if (!test(i)) return false;
    return true;
  }

  // Moves the median of a range to its middle, on the axis on which the range extends most.
  void divide(Range range) {
    Position low = points_[range.begin].position, high = low;
    for (size_t i = range.begin; i < range.end; ++i)
      for (size_t axis = 0; axis < K; ++axis) {
        low[axis] = std::min(low[axis], points_[i].position[axis]);
        high[axis] = std::max(high[axis], points_[i].position[axis]);
      }
    size_t widest = 0;
    for (size_t axis = 1; axis < K; ++axis)
      if (high[axis] - low[axis] > high[widest] - low[widest]) widest = axis;
    const auto at = [this](size_t i) { return points_.begin() + static_cast<ptrdiff_t>(i); };
    std::nth_element(at(range.begin), at(range.middle()), at(range.end),
                     [widest](const Point& a, const Point& b) { return a.position[widest] < b.position[widest]; });
    axes_[range.middle()] = static_cast<uint8_t>(widest);
  }

  // Checks the order of all divided ranges. O(n log n).
  void check_invariants() const {
    Ranges pending;
    push(pending, {0, points_.size()});
    while (!pending.empty()) {
      const Range range = pending.back();
      pending.pop_back();
      if (range.end - range.begin <= kLeafPoints) continue;
      const size_t middle = range.middle(), axis = axes_[middle];
      for (size_t i = range.begin; i < range.end; ++i) {
        const S plane = points_[middle].position[axis], x = points_[i].position[axis];
        LOCUS_DCHECK(i <= middle ? x <= plane : x >= plane);
      }
      push(pending, {middle + 1, range.end});
      push(pending, {range.begin, middle});
    }
  }

  std::vector<Point> points_;
  std::vector<uint8_t> axes_;  // of each point that divides a range
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_KD_POINTS_KD_POINTS_H_
