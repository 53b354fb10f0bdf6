// View of the objects and instances of a scene at one time, which may lie between two recorded ticks. Queries search
// this view. Borrows from a snapshot and is cheap to copy; the instances of a view live as long as the view or a copy.
// Any thread may use a view.
//
// An object exists at a time if it existed at the end of the last recorded tick that is not after that time. If the
// same lifetime of the object exists at the next recorded tick, the object moves in a straight line to its position at
// that tick; otherwise the object stays in place. A search widens its region by the displacement bound, finds objects
// at their positions at the earlier recorded tick, and interpolates each object found. Instances follow the same rules;
// a set of the interpolated instances is made for the view. At a recorded tick, and at the latest revision, nothing is
// interpolated or widened.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_SCENE_AT_TIME_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_SCENE_AT_TIME_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "core/base/planted_bug.h"
#include "core/index/hash_grid/region_walk.h"
#include "core/scene/snapshot/instances_between.h"
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
  // Creates a view of `objects` and `statics` at their stored positions.
  SceneAtTime(const ObjectSet& objects, const StaticSet& statics) : at_(&objects), statics_(&statics) {}
  // Creates a view of the objects `at`, interpolated towards `next` with 0 <= weight <= 1, and of the instances
  // `statics`, interpolated towards `next_statics`. `displacement` is the displacement from `at` to `next`.
  SceneAtTime(const ObjectSet& at, const ObjectSet& next, double weight, const Displacement& displacement,
              const StaticSet& statics, const StaticSet& next_statics);

  // Returns true if the time lies between two records, so that objects may be away from their stored positions.
  bool between() const { return next_ != nullptr; }
  // Returns the objects that exist at this time, at their stored positions.
  const ObjectSet& objects() const { return *at_; }
  // Returns the instances at this time, at their interpolated positions. Between two ticks at which instances moved,
  // the first call for a view and its copies makes the set: see InstancesBetween::get().
  const StaticSet& statics() const { return between_ == nullptr ? *statics_ : between_->get(); }
  // Takes the memory of the set that statics() makes from `budget`, before the first call of statics(). If no instance
  // moves up to the next tick, the view uses the instances of its tick from then on, and takes nothing. Returns the
  // bytes taken, or nullopt if the budget does not suffice.
  std::optional<uint64_t> take_interpolated_bytes(InterpolationBudget& budget) {
    const uint64_t bytes = between_ == nullptr ? 0 : budget.cost(*statics_, *next_statics_);
    if (bytes == 0) between_ = nullptr;
    return budget.take(bytes) ? std::optional(bytes) : std::nullopt;
  }
  // Returns whether statics() interpolates instances.
  bool interpolates_statics() const { return between_ != nullptr; }
  // Returns the shape of an object of objects() at its interpolated position and rotation.
  Shape shape(const GridRef& object) const { return next_ == nullptr ? shape_of(object) : shape_between(object); }

  // Returns an upper bound of the distance between an object's interpolated and stored positions: 0 if nothing is
  // interpolated, infinity for a fast mover (an object that is listed individually because it moved far). Callers add
  // an epsilon of their own for the rounding of coordinates.
  double displacement_bound(const GridRef& object) const {
    if (fast_ != nullptr && is_fast(object.handle())) return std::numeric_limits<double>::infinity();
    return displacement_bound_;
  }

  // Returns the region of the grid in which to search for objects. Without `ball`, the objects in the box `bounds` are
  // wanted; otherwise the objects in `ball` are wanted, and `bounds` are the bounds of `ball`. The region is the box or
  // ball, widened by the displacement bound.
  GridRegion region(const Aabbd& bounds, const std::optional<Balld>& ball) const;
  // Calls visit(GridRef) once for each object that may be in a box or ball with the bounds `bounds`: for each fast
  // mover whose path may intersect `bounds`, and for each other object that ask(visit) finds. `ask` must search the
  // GridRegion that region() returns and call `visit` for each object found.
  template <class Ask, class Visit>
  void visit_asked(const Aabbd& bounds, Work& work, const Ask& ask, const Visit& visit) const;
  // Visit objects like the members of GridSnapshot with the same names, but at interpolated positions.
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
  // Passes the bounds of the path of each fast mover to might_meet(), and calls visit() for the mover if the result is
  // true. Stops and returns false as soon as visit() returns false.
  template <class MightMeet, class Visit>
  bool visit_fast(const MightMeet& might_meet, Work& work, const Visit& visit) const;

  const ObjectSet* at_;
  const ObjectSet* next_ = nullptr;
  double weight_ = 0;
  double displacement_bound_ = 0;                 // maximum distance of an object from its position in at_
  const std::vector<FastMover>* fast_ = nullptr;  // objects exempt from displacement_bound_, ascending by handle
  const StaticSet* statics_;
  const StaticSet* next_statics_ = nullptr;
  std::shared_ptr<const InstancesBetween> between_;  // null if no instance is known to change up to the next tick
};

// Returns the view of the scene at `time`, or nullopt if `time` is before the oldest recorded tick or after the
// snapshot's own tick. O(log n) for n recorded ticks.
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
