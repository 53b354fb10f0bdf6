// Collectors: what to do with the candidates that a structure hands over. Each is a visitor for one thread and one
// query; the nearest, any, all hits of a ray, and all values of a region. Kept apart from traversal, so that every
// structure serves every kind of question.
#ifndef LOCUS_CORE_INDEX_COLLECTORS_H_
#define LOCUS_CORE_INDEX_COLLECTORS_H_

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/index/spatial_index.h"

namespace locus {

// Nearest hit before a limit; the lower id wins at equal distance.
template <class Value>
class NearestVisitor {
  using Traits = PrimitiveTraits<Value>;
  using S = ScalarOf<Value>;

 public:
  NearestVisitor(const typename Traits::RayQuery& ray, S distance) : ray_(ray), distance_(distance) {}
  S limit() const { return ray_.to_scaled(distance_); }
  bool visit(const Value& value) {
    const std::optional<S> t = Traits::ray(value, ray_);
    if (!t) return true;
    const bool nearer =
        best_ == nullptr ? *t < distance_ : std::pair(*t, Traits::id(value)) < std::pair(distance_, Traits::id(*best_));
    if (nearer) {
      distance_ = *t;
      best_ = &value;
    }
    return true;
  }
  const Value* best() const { return best_; }
  S distance() const { return distance_; }

 private:
  const typename Traits::RayQuery& ray_;
  S distance_;
  const Value* best_ = nullptr;
};

// Every hit with t < distance, in visiting order; stops after the first where `first_only`.
template <class Value>
class HitsVisitor {
  using Traits = PrimitiveTraits<Value>;
  using S = ScalarOf<Value>;

 public:
  struct Hit {
    S t;
    const Value* value;
  };
  HitsVisitor(const typename Traits::RayQuery& ray, S distance, bool first_only)
      : ray_(ray), distance_(distance), first_only_(first_only) {}
  S limit() const { return ray_.to_scaled(distance_); }
  bool visit(const Value& value) {
    const std::optional<S> t = Traits::ray(value, ray_);
    if (t && *t < distance_) hits_.push_back({*t, &value});
    return !(first_only_ && !hits_.empty());
  }
  std::vector<Hit>& hits() { return hits_; }

 private:
  const typename Traits::RayQuery& ray_;
  S distance_;
  bool first_only_;
  std::vector<Hit> hits_;
};

// Values for which `Test` holds, appended.
template <class Value, class Query, class Overlaps, class Test>
class RegionCollector {
  using S = ScalarOf<Value>;

 public:
  RegionCollector(const Aabb<S>& bounds, Overlaps overlaps, Test test, std::vector<Value>& result)
      : bounds_(bounds), overlaps_(overlaps), test_(test), result_(result) {}
  Aabb<S> bounds() const { return bounds_; }
  bool overlaps(const Aabb<S>& box) const { return overlaps_(box); }
  bool visit(const Value& value) {
    if (test_(value)) result_.push_back(value);
    return true;
  }

 private:
  Aabb<S> bounds_;
  Overlaps overlaps_;
  Test test_;
  std::vector<Value>& result_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_COLLECTORS_H_
