// Query for the values nearest to a point; one template serves every structure. The query is exact: it compares the
// distances that PrimitiveTraits computes in double. All structures return the same results.
#ifndef LOCUS_CORE_INDEX_QUERIES_NEAREST_VALUES_H_
#define LOCUS_CORE_INDEX_QUERIES_NEAREST_VALUES_H_

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/base/check.h"
#include "core/index/queries/index_queries.h"

namespace locus {

// Value and its distance from the point of a query.
template <class V, class Traits = PrimitiveTraits<V>>
requires Measurable<V, Traits>
struct ValueAt {
  double distance;
  V value;

  // Orders by distance, then by id.
  friend bool operator<(const ValueAt& a, const ValueAt& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    return Traits::id(a.value) < Traits::id(b.value);
  }
};

// Collector of nearest_values(). Until finish() is called, the appended values are a heap whose top is the farthest
// value. If the heap is full, a nearer value replaces the top. One object per query and thread.
template <class V, class Traits = PrimitiveTraits<V>>
requires Measurable<V, Traits>
class NearestValuesVisitor {
 public:
  NearestValuesVisitor(const Vec3d& point, double max_distance, size_t max_values,
                       std::vector<ValueAt<V, Traits>>& result)
      : point_(point),
        max_distance_(max_distance),
        limit_(squared_limit(max_distance)),
        max_values_(max_values),
        begin_(static_cast<ptrdiff_t>(result.size())),
        result_(result) {}

  double limit() const { return limit_; }
  bool visit(const V& value) {
    if (max_values_ == 0) return false;
    const ValueAt<V, Traits> found = {Traits::distance(value, point_), value};
    if (found.distance <= max_distance_) add(found);
    return true;
  }

  // Sorts the appended values. The collector must not be used afterwards.
  void finish() {
    LOCUS_DCHECK(std::is_heap(result_.begin() + begin_, result_.end()));
    std::sort_heap(result_.begin() + begin_, result_.end());
  }

 private:
  bool full() const { return result_.size() - static_cast<size_t>(begin_) == max_values_; }
  void add(const ValueAt<V, Traits>& found) {
    const auto first = result_.begin() + begin_;
    if (full()) {
      if (!(found < *first)) return;
      std::pop_heap(first, result_.end());
      result_.back() = found;
    } else {
      result_.push_back(found);
    }
    std::push_heap(result_.begin() + begin_, result_.end());
    LOCUS_DCHECK_LE(result_.size() - static_cast<size_t>(begin_), max_values_);
    if (full()) limit_ = squared_limit(result_[static_cast<size_t>(begin_)].distance);
  }

  const Vec3d point_;
  const double max_distance_;
  double limit_;
  const size_t max_values_;
  const ptrdiff_t begin_;
  std::vector<ValueAt<V, Traits>>& result_;
};

// Appends the `max_values` values nearest to `point` at distances <= max_distance, sorted by distance, then by id. If
// `work` is not null, the query adds its cost to `*work`. Cost: the cost of the structure's visit_nearest(), plus O(log
// max_values) for each value that enters the heap of results.
template <SpatialIndex Index>
void nearest_values(const Index& index, const Vec3d& point, double max_distance, size_t max_values,
                    std::vector<ValueAt<typename Index::Value, typename Index::Traits>>& result, Work* work = nullptr) {
  internal::CostCounter counter(work);
  NearestValuesVisitor<typename Index::Value, typename Index::Traits> visitor(point, max_distance, max_values, result);
  index.visit_nearest(point, visitor, counter.get());
  visitor.finish();
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_QUERIES_NEAREST_VALUES_H_
