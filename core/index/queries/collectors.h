// Collectors: visitors that test the candidates of an index structure and store the results. Results are the nearest
// hit of a ray, any hit, the nearest few hits, or all values whose bounds overlap a ray or a region. Collectors are
// separate from traversal, so that every structure supports every kind of query. One object per query and thread; each
// object borrows its query.
#ifndef LOCUS_CORE_INDEX_QUERIES_COLLECTORS_H_
#define LOCUS_CORE_INDEX_QUERIES_COLLECTORS_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/check.h"
#include "core/index/regions.h"
#include "core/index/spatial_index.h"

namespace locus {

// Collector of the nearest hit at a distance strictly less than `distance`; among hits at equal distance the lower id
// wins.
template <class V, class Traits = PrimitiveTraits<V>>
requires Primitive<V, Traits>
class NearestVisitor {
  using S = typename Traits::Scalar;

 public:
  NearestVisitor(const typename Traits::RayQuery& ray, S distance)
      : ray_(ray), distance_(distance), limit_(ray.to_scaled(distance)) {}

  S limit() const { return limit_; }
  bool visit(const V& value) {
    const std::optional<S> t = Traits::ray(value, ray_);
    if (!t || !wins(*t, value)) return true;
    distance_ = *t;
    limit_ = ray_.to_scaled(*t);
    best_ = value;
    best_id_ = Traits::id(value);
    return true;
  }

  // Returns the nearest value that was hit, or nullopt if there was no hit nearer than the constructor's `distance`.
  const std::optional<V>& best() const { return best_; }
  // Returns the distance of best(), or the constructor's `distance` if best() is nullopt.
  S distance() const { return distance_; }

 private:
  bool wins(S t, const V& value) const {
    return t < distance_ || (t == distance_ && best_ && Traits::id(value) < best_id_);
  }

  const typename Traits::RayQuery& ray_;
  S distance_;
  S limit_;
  std::optional<V> best_;
  uint64_t best_id_ = 0;  // id of best_; GCC warns that the id in the optional may be uninitialised
};

// Collector that checks for any hit at a distance strictly less than `distance`. Ends the visit at the first hit found.
template <class V, class Traits = PrimitiveTraits<V>>
requires Primitive<V, Traits>
class AnyHitVisitor {
  using S = typename Traits::Scalar;

 public:
  AnyHitVisitor(const typename Traits::RayQuery& ray, S distance)
      : ray_(ray), distance_(distance), limit_(ray.to_scaled(distance)) {}

  S limit() const { return limit_; }
  bool visit(const V& value) {
    const std::optional<S> t = Traits::ray(value, ray_);
    found_ = t && *t < distance_;
    return !found_;
  }
  bool found() const { return found_; }

 private:
  const typename Traits::RayQuery& ray_;
  S distance_;
  S limit_;
  bool found_ = false;
};

// Hit of a ray: the value and its distance, in units of the ray's direction.
template <class V, class Traits = PrimitiveTraits<V>>
struct RayHit {
  typename Traits::Scalar distance;
  V value;

  friend bool operator==(const RayHit&, const RayHit&) = default;
};

// Returns true if hit `a` precedes hit `b` in the order by distance, then by id.
template <class V, class Traits>
bool comes_before(const RayHit<V, Traits>& a, const RayHit<V, Traits>& b) {
  if (a.distance != b.distance) return a.distance < b.distance;
  return Traits::id(a.value) < Traits::id(b.value);
}

// Collector of the nearest `max_hits` hits at distances strictly less than `distance`. Appends the hits to `result`.
// Until finish() the appended part is a heap whose top is its farthest hit; a nearer hit replaces the top.
template <class V, class Traits = PrimitiveTraits<V>>
requires Primitive<V, Traits>
class NearestFewVisitor {
  using S = typename Traits::Scalar;

 public:
  NearestFewVisitor(const typename Traits::RayQuery& ray, S distance, size_t max_hits,
                    std::vector<RayHit<V, Traits>>& result)
      : ray_(ray),
        distance_(distance),
        limit_(ray.to_scaled(distance)),
        max_hits_(max_hits),
        begin_(static_cast<ptrdiff_t>(result.size())),
        result_(result) {}

  S limit() const { return limit_; }
  bool visit(const V& value) {
    if (max_hits_ == 0) return false;
    const std::optional<S> t = Traits::ray(value, ray_);
    if (t && *t < distance_) add({*t, value});
    return true;
  }

  // Sorts the appended hits. The collector must not be used afterwards.
  void finish() {
    LOCUS_DCHECK(std::is_heap(result_.begin() + begin_, result_.end(), comes_before<V, Traits>));
    std::sort_heap(result_.begin() + begin_, result_.end(), comes_before<V, Traits>);
  }

 private:
  bool full() const { return result_.size() - static_cast<size_t>(begin_) == max_hits_; }
  void add(const RayHit<V, Traits>& hit) {
    const auto first = result_.begin() + begin_;
    if (full()) {
      if (!comes_before(hit, *first)) return;
      std::pop_heap(first, result_.end(), comes_before<V, Traits>);
      result_.back() = hit;
    } else {
      result_.push_back(hit);
    }
    std::push_heap(result_.begin() + begin_, result_.end(), comes_before<V, Traits>);
    LOCUS_DCHECK_LE(result_.size() - static_cast<size_t>(begin_), max_hits_);
    if (full()) limit_ = ray_.to_scaled(result_[static_cast<size_t>(begin_)].distance);
  }

  const typename Traits::RayQuery& ray_;
  S distance_;
  S limit_;
  size_t max_hits_;
  ptrdiff_t begin_;
  std::vector<RayHit<V, Traits>>& result_;
};

// Collector of the values whose bounds the ray enters at a distance of at most `distance`, by the slab test alone.
// Appends these values to `result`.
template <class V, class Traits = PrimitiveTraits<V>>
requires Primitive<V, Traits>
class BoundsOnRayVisitor {
  using S = typename Traits::Scalar;

 public:
  BoundsOnRayVisitor(const typename Traits::RayQuery& ray, S distance, std::vector<V>& result)
      : slabs_(ray.slabs()), limit_(ray.to_scaled(distance)), result_(result) {}

  S limit() const { return limit_; }
  bool visit(const V& value) {
    const Interval<S> interval = slabs_.interval(Traits::bounds(value));
    if (interval.near <= interval.far && interval.far >= 0 && interval.near <= limit_) result_.push_back(value);
    return true;
  }

 private:
  const SlabRay<S>& slabs_;
  S limit_;
  std::vector<V>& result_;
};

// Collector of the values whose bounds overlap `region` and for which test(value) returns true. Appends these values to
// `result`. An exact query passes the exact predicate as `test`; a conservative query passes a test that is always
// true. So exact results are a subset of conservative results, and both are the same for every structure.
template <class V, class Region, class Test, class Traits = PrimitiveTraits<V>>
requires Bounded<V, Traits>
class RegionCollector {
  using S = typename Traits::Scalar;

 public:
  RegionCollector(const Region& region, Test test, std::vector<V>& result)
      : region_(region), test_(test), result_(result) {}

  Aabb<S> bounds() const { return region_.bounds(); }
  bool overlaps(const Aabb<S>& box) const { return region_.overlaps(box); }
  bool visit(const V& value) {
    if (region_.overlaps(Traits::bounds(value)) && test_(value)) result_.push_back(value);
    return true;
  }

 private:
  const Region& region_;
  Test test_;
  std::vector<V>& result_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_QUERIES_COLLECTORS_H_
