// View of the moving objects of a scene at one time, which may lie between two recorded ticks. Queries run on it.
// Borrows from a snapshot; cheap to copy; any thread.
//
// An object exists at a time if it existed at the end of the recorded tick before. It moves, in a straight line, only
// if the same lifetime exists at the next recorded tick. A search runs on the stored set of the tick before, widened by
// the displacement bound, and each object found is interpolated. At a recorded tick, and at the latest revision,
// nothing is interpolated or widened.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_SCENE_AT_TIME_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_SCENE_AT_TIME_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/base/planted_bug.h"
#include "core/index/hash_grid/region_walk.h"
#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

// Point in time: a tick and the fraction of the way to the next tick, 0 <= fraction < 1.
struct AsOf {
  uint64_t tick = 0;
  float fraction = 0;

  friend constexpr bool operator==(const AsOf&, const AsOf&) = default;
};

class SceneAtTime {
 public:
  // View of `objects` at their stored positions.
  explicit SceneAtTime(const ObjectSet& objects) : at_(&objects) {}
  // View of the objects `at`, interpolated towards `next`: 0 <= weight < 1. `displacement` is from `at` to `next`.
  SceneAtTime(const ObjectSet& at, const ObjectSet& next, double weight, const Displacement& displacement);

  // Returns true if the time lies between two records, so that objects may be away from their stored positions.
  bool between() const { return next_ != nullptr; }
  // Returns the objects that exist at this time, at their stored positions.
  const ObjectSet& objects() const { return *at_; }
  // Returns the shape of an object of objects() at its interpolated position and rotation.
  Shape shape(const GridRef& object) const { return next_ == nullptr ? shape_of(object) : shape_between(object); }

  // Returns an upper bound of the distance between an object's interpolated and stored positions: 0 if nothing is
  // interpolated, infinity for a fast mover. Callers add their own allowance for the rounding of coordinates.
  double displacement_bound(const GridRef& object) const {
    if (fast_ != nullptr && is_fast(object.handle())) return std::numeric_limits<double>::infinity();
    return displacement_bound_;
  }

  // Returns the region of the grid of objects() to search for a query in the box `bounds` or, if given, in `ball`,
  // whose bounds are `bounds`.
  GridRegion region(const Aabbd& bounds, const std::optional<Balld>& ball) const;
  // Calls visit(GridRef) for the objects in that box or ball: the fast movers that may be in `bounds`, and the objects
  // that ask(visit) finds in region(). Each object once.
  template <class Ask, class Visit>
  void visit_asked(const Aabbd& bounds, Work& work, const Ask& ask, const Visit& visit) const;
  // Like the members of GridSnapshot, for objects() at their interpolated positions.
  template <class Limit, class Visit>
  void visit_ray(const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit) const;
  template <class Limit, class Visit>
  void visit_nearest(const Vec3d& point, const Limit& limit, Work& work, const Visit& visit) const;

 private:
  Shape shape_between(const GridRef& object) const;
  bool is_fast(uint32_t handle) const {
    const auto at = std::lower_bound(fast_->begin(), fast_->end(), handle,
                                     [](const FastMover& mover, uint32_t value) { return mover.handle < value; });
    return at != fast_->end() && at->handle == handle;
  }
  // Calls visit() for the fast movers for which might_meet(bounds of all their positions). Returns false once visit()
  // returned false.
  template <class MightMeet, class Visit>
  bool visit_fast(const MightMeet& might_meet, Work& work, const Visit& visit) const;

  const ObjectSet* at_;
  const ObjectSet* next_ = nullptr;
  double weight_ = 0;
  double displacement_bound_ = 0;                 // maximum distance of an object from its position in at_ ...
  const std::vector<FastMover>* fast_ = nullptr;  // ... except for these, ascending by handle
};

// Returns the view of that time, or nullopt if it is before the oldest kept tick or after the snapshot's own tick.
// O(log records).
std::optional<SceneAtTime> find_scene_at(const SceneSnapshot& snapshot, const AsOf& time);
// Returns the time nearest to `time` for which find_scene_at() returns a view.
AsOf nearest_kept(const SceneSnapshot& snapshot, const AsOf& time);

template <class MightMeet, class Visit>
bool SceneAtTime::visit_fast(const MightMeet& might_meet, Work& work, const Visit& visit) const {
  for (const FastMover& mover : *fast_) {
    ++work.cells;
    const double epsilon = internal::kBoundsGrowth * (magnitude(mover.centers) + double{mover.extent});
    if (!might_meet(grown(mover.centers, double{mover.extent} + epsilon))) continue;
    ++work.tests;
    if (!visit(at_->grid().at(mover.handle))) return false;
  }
  return true;
}

template <class Ask, class Visit>
void SceneAtTime::visit_asked(const Aabbd& bounds, Work& work, const Ask& ask, const Visit& visit) const {
  if (fast_ == nullptr) return ask(visit);
  if (!visit_fast([&bounds](const Aabbd& path) { return overlaps(path, bounds); }, work, visit)) return;
  ask([&](const GridRef& object) { return is_fast(object.handle()) || visit(object); });
}

template <class Limit, class Visit>
void SceneAtTime::visit_ray(const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit) const {
  if (next_ == nullptr) return at_->grid().visit_ray(ray, limit, work, visit);
  const double bound = planted(PlantedBug::kRewindReach) ? 0 : displacement_bound_;
  if (fast_ == nullptr) return at_->grid().visit_ray(ray, limit, work, visit, bound);
  const auto might_meet = [&](const Aabbd& bounds) {
    const Interval<double> part = ray.interval(bounds);
    return part.near <= part.far && part.far >= 0 && part.near <= limit();
  };
  if (!visit_fast(might_meet, work, visit)) return;
  at_->grid().visit_ray(
      ray, limit, work, [&](const GridRef& object) { return is_fast(object.handle()) || visit(object); }, bound);
}

template <class Limit, class Visit>
void SceneAtTime::visit_nearest(const Vec3d& point, const Limit& limit, Work& work, const Visit& visit) const {
  if (next_ == nullptr) return at_->grid().visit_nearest(point, limit, work, visit);
  const double bound = planted(PlantedBug::kRewindReach) ? 0 : displacement_bound_;
  const auto wider = [&limit, bound] { return squared_limit(std::sqrt(limit()) + bound) * (1 + 0x1p-40); };
  if (fast_ == nullptr) return at_->grid().visit_nearest(point, wider, work, visit);
  const auto might_meet = [&](const Aabbd& bounds) { return squared_distance(point, bounds) <= limit(); };
  if (!visit_fast(might_meet, work, visit)) return;
  at_->grid().visit_nearest(point, wider, work,
                            [&](const GridRef& object) { return is_fast(object.handle()) || visit(object); });
}

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SCENE_AT_TIME_H_
