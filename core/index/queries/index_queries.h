// Queries of an index, written once for every structure: rays (first, any, all) and overlaps with balls and boxes. An
// exact query applies the predicates of the values; a conservative query tests only their bounds. Results are appended
// to the given vector and never overwrite its contents; overlap results are in the order of the structure. All
// structures return the same results.
//
// A ray ends at the parameter `distance`; the ray's own t_max is ignored. Distances are in units of the ray's
// direction. If `work` is not null, the query adds its cost to `*work`. The cost of a query is the cost of the
// structure's visit. Threads: queries only read the index, so any number of them may run concurrently. Source: Hughes
// et al., Computer Graphics: Principles and Practice, 3rd ed., 2013, ch. 37 (the query interface).
#ifndef LOCUS_CORE_INDEX_QUERIES_INDEX_QUERIES_H_
#define LOCUS_CORE_INDEX_QUERIES_INDEX_QUERIES_H_

#include <cstddef>
#include <vector>

#include "core/index/queries/collectors.h"

namespace locus {

template <class Index>
using RayQueryOf = typename Index::Traits::RayQuery;
template <class Index>
using BallQueryOf = typename Index::Traits::BallQuery;
template <class Index>
using BoxQueryOf = typename Index::Traits::BoxQuery;
template <class Index>
using DistanceOf = typename Index::Traits::Scalar;
template <class Index>
using RayHitOf = RayHit<typename Index::Value, typename Index::Traits>;

namespace internal {
// Reference to the counter of a query's cost: the caller's counter `work` or, if `work` is null, an internal counter.
class CostCounter {
 public:
  explicit CostCounter(Work* work) : work_(work != nullptr ? *work : own_) {}
  Work& get() { return work_; }

 private:
  Work own_;
  Work& work_;
};

template <class Index, class Region, class Test>
void collect_region(const Index& index, const Region& region, Test test, std::vector<typename Index::Value>& result,
                    Work* work) {
  CostCounter counter(work);
  RegionCollector<typename Index::Value, Region, Test, typename Index::Traits> collector(region, test, result);
  index.visit_region(collector, counter.get());
}

inline constexpr auto kBoundsDecide = [](const auto&) { return true; };
}  // namespace internal

// Finds the first hit among several indices of one value type. If there is a hit at a distance strictly less than
// `distance`, sets `value` and `distance` to the value and distance of the nearest hit and returns true. Otherwise
// leaves both unchanged and returns false. The limit for each index is the nearest distance found in the indices before
// it. Among hits at equal distance the lower id wins, even if the hits are in different indices. Do not join calls of
// first_ray() by || instead: a hit in the first index would skip the second index, which may hold a nearer hit.
template <SpatialIndex Index, SpatialIndex... Others>
bool first_ray_of(const RayQueryOf<Index>& ray, typename Index::Value& value, DistanceOf<Index>& distance, Work* work,
                  const Index& index, const Others&... others) {
  internal::CostCounter counter(work);
  NearestVisitor<typename Index::Value, typename Index::Traits> nearest(ray, distance);
  index.visit_ray(ray.slabs(), nearest, counter.get());
  (others.visit_ray(ray.slabs(), nearest, counter.get()), ...);
  if (!nearest.best()) return false;
  value = *nearest.best();
  distance = nearest.distance();
  return true;
}

// Finds the first hit in one index, as first_ray_of() does.
template <SpatialIndex Index>
bool first_ray(const Index& index, const RayQueryOf<Index>& ray, typename Index::Value& value,
               DistanceOf<Index>& distance, Work* work = nullptr) {
  return first_ray_of(ray, value, distance, work, index);
}

// Returns true if the ray hits any value at a distance strictly less than `distance`.
template <SpatialIndex Index>
bool any_ray(const Index& index, const RayQueryOf<Index>& ray, DistanceOf<Index> distance, Work* work = nullptr) {
  internal::CostCounter counter(work);
  AnyHitVisitor<typename Index::Value, typename Index::Traits> any(ray, distance);
  index.visit_ray(ray.slabs(), any, counter.get());
  return any.found();
}

// Appends the nearest `max_hits` hits at distances strictly less than `distance`, sorted by distance, then by id.
template <SpatialIndex Index>
void all_rays(const Index& index, const RayQueryOf<Index>& ray, DistanceOf<Index> distance, size_t max_hits,
              std::vector<RayHitOf<Index>>& result, Work* work = nullptr) {
  internal::CostCounter counter(work);
  NearestFewVisitor<typename Index::Value, typename Index::Traits> few(ray, distance, max_hits, result);
  index.visit_ray(ray.slabs(), few, counter.get());
  few.finish();
}

// Appends the values whose bounds the ray enters at a distance of at most `distance`: a superset of the values that
// all_rays() finds.
template <SpatialIndex Index>
void conservative_ray(const Index& index, const RayQueryOf<Index>& ray, DistanceOf<Index> distance,
                      std::vector<typename Index::Value>& result, Work* work = nullptr) {
  internal::CostCounter counter(work);
  BoundsOnRayVisitor<typename Index::Value, typename Index::Traits> on_ray(ray, distance, result);
  index.visit_ray(ray.slabs(), on_ray, counter.get());
}

// Appends the values that share a point with the ball.
template <SpatialIndex Index>
void ball_overlap(const Index& index, const BallQueryOf<Index>& ball, std::vector<typename Index::Value>& result,
                  Work* work = nullptr) {
  const auto exact = [&ball](const auto& value) { return Index::Traits::ball(value, ball); };
  internal::collect_region(index, BallRegion(ball), exact, result, work);
}

// Appends the values whose bounds share a point with the ball: a superset of ball_overlap().
template <SpatialIndex Index>
void conservative_ball(const Index& index, const BallQueryOf<Index>& ball, std::vector<typename Index::Value>& result,
                       Work* work = nullptr) {
  internal::collect_region(index, BallRegion(ball), internal::kBoundsDecide, result, work);
}

// Appends the values that share a point with the box, which may be rotated.
template <SpatialIndex Index>
void box_overlap(const Index& index, const BoxQueryOf<Index>& box, std::vector<typename Index::Value>& result,
                 Work* work = nullptr) {
  const auto exact = [&box](const auto& value) { return Index::Traits::box(value, box); };
  internal::collect_region(index, BoxRegion(box), exact, result, work);
}

// Appends the values whose bounds overlap the axis-aligned bounds of the box: a superset of box_overlap().
template <SpatialIndex Index>
void conservative_box(const Index& index, const BoxQueryOf<Index>& box, std::vector<typename Index::Value>& result,
                      Work* work = nullptr) {
  internal::collect_region(index, BoxRegion(box), internal::kBoundsDecide, result, work);
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_QUERIES_INDEX_QUERIES_H_
