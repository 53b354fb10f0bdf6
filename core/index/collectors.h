// Collectors: what to do with the candidates that a structure hands over. Each is a visitor for one thread and one
// query: the nearest hit, any hit, the nearest few hits of a ray, the values a ray's or a region's bounds meet. Kept
// apart from traversal, so that every structure serves every kind of question. They borrow the query.
#ifndef LOCUS_CORE_INDEX_COLLECTORS_H_
#define LOCUS_CORE_INDEX_COLLECTORS_H_

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/index/regions.h"
#include "core/index/spatial_index.h"

namespace locus {

// Nearest hit before a limit, strictly; the lower id wins at equal distance.
template <Primitive V>
class NearestVisitor {
  using Traits = PrimitiveTraits<V>;
  using S = ScalarOf<V>;

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
    return true;
  }

  // Nothing when nothing was hit before the limit.
  const std::optional<V>& best() const { return best_; }
  // Of the best hit; the limit as given without one.
  S distance() const { return distance_; }

 private:
  bool wins(S t, const V& value) const {
    return t < distance_ || (t == distance_ && best_ && Traits::id(value) < Traits::id(*best_));
  }

  const typename Traits::RayQuery& ray_;
  S distance_;
  S limit_;
  std::optional<V> best_;
};

// Whether anything is hit before a limit, strictly. Ends the visit at the first hit.
template <Primitive V>
class AnyHitVisitor {
  using Traits = PrimitiveTraits<V>;
  using S = ScalarOf<V>;

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

template <Bounded V>
struct RayHit {
  ScalarOf<V> distance;
  V value;

  friend bool operator==(const RayHit&, const RayHit&) = default;
};

// Order of hits: by distance, then by id.
template <Bounded V>
bool comes_before(const RayHit<V>& a, const RayHit<V>& b) {
  if (a.distance != b.distance) return a.distance < b.distance;
  return PrimitiveTraits<V>::id(a.value) < PrimitiveTraits<V>::id(b.value);
}

// The nearest `max_hits` hits before a limit, appended to `result`. Until finish() the appended part is a heap with its
// last hit on top, which a nearer one replaces.
template <Primitive V>
class NearestFewVisitor {
  using Traits = PrimitiveTraits<V>;
  using S = ScalarOf<V>;

 public:
  NearestFewVisitor(const typename Traits::RayQuery& ray, S distance, size_t max_hits, std::vector<RayHit<V>>& result)
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

  // Sorts what was appended. The visitor is done after it.
  void finish() { std::sort_heap(result_.begin() + begin_, result_.end(), comes_before<V>); }

 private:
  bool full() const { return result_.size() - static_cast<size_t>(begin_) == max_hits_; }
  void add(const RayHit<V>& hit) {
    const auto first = result_.begin() + begin_;
    if (full()) {
      if (!comes_before(hit, *first)) return;
      std::pop_heap(first, result_.end(), comes_before<V>);
      result_.back() = hit;
    } else {
      result_.push_back(hit);
    }
    std::push_heap(result_.begin() + begin_, result_.end(), comes_before<V>);
    if (full()) limit_ = ray_.to_scaled(result_[static_cast<size_t>(begin_)].distance);
  }

  const typename Traits::RayQuery& ray_;
  S distance_;
  S limit_;
  size_t max_hits_;
  ptrdiff_t begin_;
  std::vector<RayHit<V>>& result_;
};

// Values whose bounds the ray meets at or before a limit, appended: decided by the slab test alone.
template <Primitive V>
class BoundsOnRayVisitor {
  using Traits = PrimitiveTraits<V>;
  using S = ScalarOf<V>;

 public:
  BoundsOnRayVisitor(const typename Traits::RayQuery& ray, S distance, std::vector<V>& result)
      : slabs_(ray.slabs()), limit_(ray.to_scaled(distance)), result_(result) {}

  S limit() const { return limit_; }
  bool visit(const V& value) {
    const Interval<S> own = slabs_.interval(Traits::bounds(value));
    if (own.near <= own.far && own.far >= 0 && own.near <= limit_) result_.push_back(value);
    return true;
  }

 private:
  const SlabRay<S>& slabs_;
  S limit_;
  std::vector<V>& result_;
};

// Values whose bounds a region reaches and that pass `test`, appended. The bounds are part of the verdict, so that the
// exact answer lies within the conservative one and no structure can change either.
template <Bounded V, class Region, class Test>
class RegionCollector {
  using Traits = PrimitiveTraits<V>;
  using S = ScalarOf<V>;

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

#endif  // LOCUS_CORE_INDEX_COLLECTORS_H_
