#include "core/query/kinds/pair_query.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/shape_distance.h"
#include "core/query/kinds/hit_collector.h"

namespace locus {
namespace {

// Order of the rows of one block, and their position behind which the answer begins.
struct PairOrder {
  bool by_distance;  // with k: (id, t, other); otherwise (id, other)

  bool operator()(const PairRow& a, const PairRow& b) const {
    const float ta = by_distance ? a.first.t : 0, tb = by_distance ? b.first.t : 0;
    return std::tie(a.first.id, ta, a.other) < std::tie(b.first.id, tb, b.other);
  }
};

// Collector of the first rows in order. Invariant: it has at most 2 * max_rows_ + 1 rows, and after keep_first() at
// most max_rows_.
class FirstPairs {
 public:
  FirstPairs(PairOrder order, size_t max_rows, bool count_only)
      : order_(order), max_rows_(max_rows), count_only_(count_only) {}

  void offer(const PairRow& row) {
    ++answer_.count;
    if (count_only_) return;
    answer_.rows.push_back(row);
    if (answer_.rows.size() > 2 * max_rows_) keep_first();
  }
  // Returns whether rows of an object with this id can still be among the first rows.
  bool has_room_for(Id id) const { return count_only_ || id <= last_id_; }
  PairAnswer finish() {
    if (!count_only_) keep_first();
    std::sort(answer_.rows.begin(), answer_.rows.end(), order_);
    return std::move(answer_);
  }

 private:
  void keep_first() {
    if (answer_.rows.size() <= max_rows_) return;
    answer_.truncated = true;
    const auto last = answer_.rows.begin() + static_cast<std::ptrdiff_t>(max_rows_);
    std::nth_element(answer_.rows.begin(), last - 1, answer_.rows.end(), order_);
    last_id_ = (last - 1)->first.id;
    answer_.rows.erase(last, answer_.rows.end());
  }

  const PairOrder order_;
  const size_t max_rows_;
  const bool count_only_;
  Id last_id_ = std::numeric_limits<Id>::max();
  PairAnswer answer_;
};

// State that all searches of one block have in common.
struct PairSearch {
  QueryTask& task;
  const SceneAtTime& moment;
  const Filter filter;
  const Layers first_mask, second_mask;
  const float max_distance;
  const bool conservative;

  bool may_be_first(const GridEntry& entry) const { return (entry.layers & first_mask) != 0; }
  bool may_be_second(const GridEntry& entry) const { return (entry.layers & second_mask) != 0; }
  static bool are_apart(const GridEntry& a, const GridEntry& b) {
    return a.id != b.id && (a.group == 0 || a.group != b.group);
  }
  // Returns the rounded distance between two objects. The lower id comes first, so that both orders give one result.
  float distance(Id a_id, const Shape& a, Id b_id, const Shape& b) const {
    if (conservative) return rounded_distance(distance_between(bounds_of(a), bounds_of(b)));
    return rounded_distance(a_id < b_id ? distance_between(a, b) : distance_between(b, a));
  }
};

// Visitor of the objects within the distance of one object.
class Partners {
 public:
  // Adds the pairs of `object` with objects of higher ids to `rows`, behind the position (after_id, after_other).
  Partners(const PairSearch& search, const GridRef& object, Id after_id, Id after_other, FirstPairs& rows)
      : search_(search),
        object_(object),
        shape_(search.moment.shape(object)),
        after_id_(after_id),
        after_other_(after_other),
        rows_(rows) {
    const Aabbd own = bounds_of(shape_);
    const double reach = raised(search.max_distance);
    bounds_ = grown(own, reach + 0x1p-40 * (magnitude(own) + reach));
  }

  const Aabbd& bounds() const { return bounds_; }
  GridRegion region() const { return search_.moment.region(bounds_, std::nullopt); }
  bool visit(const GridRef& other) {
    if (!search_.task.count_test()) return false;
    const GridEntry &a = object_.entry(), &b = other.entry();
    if (b.id <= a.id && !(planted(PlantedBug::kPairBothSides) && b.id != a.id)) return true;
    if (a.id == after_id_ && b.id <= after_other_) return true;
    if (!PairSearch::are_apart(a, b) || !search_.filter.accepts(b)) return true;
    if (!(search_.may_be_first(a) && search_.may_be_second(b)) &&
        !(search_.may_be_first(b) && search_.may_be_second(a)))
      return true;
    const float distance = search_.distance(a.id, shape_, b.id, search_.moment.shape(other));
    if (distance <= search_.max_distance) rows_.offer({hit_on(object_, distance, search_.moment), b.id});
    return true;
  }

 private:
  const PairSearch& search_;
  const GridRef object_;
  const Shape shape_;
  const Id after_id_, after_other_;
  FirstPairs& rows_;
  Aabbd bounds_;
};

// Visitor of the objects near one object that keeps the nearest.
class NearestPartners {
 public:
  NearestPartners(const PairSearch& search, const GridRef& object, uint32_t count)
      : search_(search),
        object_(object),
        shape_(search.moment.shape(object)),
        extent_(extent_of(shape_, bounds_of(shape_), object, search.conservative)),
        count_(count),
        farthest_(search.max_distance) {}

  Vec3d position() const { return shape_.position; }
  // Returns the limit of squared distances from the object's position to the bounds of others.
  double limit() const {
    const double reach = raised(farthest_) + extent_;
    return squared_limit(reach * (1 + 0x1p-40));
  }
  bool visit(const GridRef& other) {
    if (!search_.task.count_test()) return false;
    const GridEntry &a = object_.entry(), &b = other.entry();
    if (!PairSearch::are_apart(a, b) || !search_.filter.accepts(b) || !search_.may_be_second(b)) return true;
    const float distance = search_.distance(a.id, shape_, b.id, search_.moment.shape(other));
    if (!(distance <= farthest_)) return true;
    rows_.push_back({hit_on(object_, distance, search_.moment), b.id});
    std::push_heap(rows_.begin(), rows_.end(), PairOrder{true});
    if (rows_.size() > count_) {
      std::pop_heap(rows_.begin(), rows_.end(), PairOrder{true});
      rows_.pop_back();
    }
    if (rows_.size() == count_) farthest_ = rows_.front().first.t;
    return true;
  }
  // Returns the rows in order; call it once.
  std::vector<PairRow> finish() {
    std::sort_heap(rows_.begin(), rows_.end(), PairOrder{true});
    return std::move(rows_);
  }

 private:
  // Returns an upper bound of the distance from the position to any point of the solid or, with CONSERVATIVE, of its
  // bounds, whose corners are farther away.
  static double extent_of(const Shape& shape, const Aabbd& bounds, const GridRef& object, bool conservative) {
    if (!conservative) return object.reach() * (1 + 0x1p-40);
    const Vec3d corner = max(abs(bounds.min - shape.position), abs(bounds.max - shape.position));
    return std::sqrt(squared_length(corner)) * (1 + 0x1p-40);
  }

  const PairSearch& search_;
  const GridRef object_;
  const Shape shape_;
  const double extent_;
  const size_t count_;
  float farthest_;
  std::vector<PairRow> rows_;  // a heap whose front is the last row
};

// Offers the rows behind the row with `after_other`, or all rows if there is no such row.
void offer_behind(const std::vector<PairRow>& rows, Id after_other, FirstPairs& first) {
  auto begin = std::find_if(rows.begin(), rows.end(), [&](const PairRow& row) { return row.other == after_other; });
  begin = begin == rows.end() ? rows.begin() : begin + 1;
  for (; begin != rows.end(); ++begin) first.offer(*begin);
}

}  // namespace

PairAnswer run_pairs(QueryTask& task, const SceneAtTime& moment, const QueryBlock& block, const PairColumns& pairs) {
  if (block.source == Source::kStatic) return {};
  const auto mask = [](Layers layers) { return layers == 0 ? kAllLayers : layers; };
  const PairSearch search{task,
                          moment,
                          Filter(block, 0),
                          mask(pairs.first_mask),
                          mask(pairs.second_mask),
                          pairs.max_distance,
                          block.precision == Precision::kConservative};
  FirstPairs rows({pairs.count != 0}, block.max_results == 0 ? limits::kDefaultMaxResults : block.max_results,
                  block.count_only);
  moment.objects().grid().for_each([&](const GridRef& object) {
    const GridEntry& entry = object.entry();
    ++task.work().tests;
    if (!task.count_test()) return false;
    // The rows of after_id itself go on behind after_other.
    const bool is_behind = entry.id > block.after_id || (entry.id == block.after_id && pairs.after_other != 0);
    if (!is_behind || !rows.has_room_for(entry.id) || !search.filter.accepts(entry)) return true;
    if (pairs.count == 0) {
      Partners visitor(search, object, block.after_id, pairs.after_other, rows);
      task.visit_objects_in_region(moment, visitor);
    } else if (search.may_be_first(entry)) {
      NearestPartners visitor(search, object, pairs.count);
      task.visit_objects_near(moment, visitor.position(), visitor);
      offer_behind(visitor.finish(), entry.id == block.after_id ? pairs.after_other : kNoId, rows);
    }
    return !task.ended();
  });
  PairAnswer answer = rows.finish();
  answer.truncated |= task.ended();
  return answer;
}

}  // namespace locus
