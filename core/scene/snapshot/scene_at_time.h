// The moving objects of a scene at one moment, which may lie between two recorded ticks: what queries ask. Borrows from
// a snapshot; cheap to copy; any thread.
//
// An object is there if it lived when the tick before the moment ended; it moves, in a straight line, only if the same
// life is there when the next one does. So the set at the tick before is searched, as much wider as objects moved, and
// each object found is put where it was. At a recorded tick and now nothing moves, and nothing is wider.
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

// A time: a tick, and how far from there to the next, 0 <= fraction < 1.
struct AsOf {
  uint64_t tick = 0;
  float fraction = 0;

  friend constexpr bool operator==(const AsOf&, const AsOf&) = default;
};

class SceneAtTime {
 public:
  // When `objects` were as they are.
  explicit SceneAtTime(const ObjectSet& objects) : at_(&objects) {}
  // Part `weight` of the way from `at` to `next`, between which objects moved by `displacement`.
  SceneAtTime(const ObjectSet& at, const ObjectSet& next, double weight, const Displacement& displacement);

  // Whether it lies between two ticks, so that objects may be elsewhere than in objects().
  bool between() const { return next_ != nullptr; }
  // Who lives.
  const ObjectSet& objects() const { return *at_; }
  // Where an object of objects() is, and how it is turned.
  Shape shape(const GridRef& object) const { return next_ == nullptr ? shape_of(object) : shape_between(object); }

  // How far from its place in objects() an object may be, but for the rounding of places; 0 where nothing moves.
  double displacement_bound(const GridRef& object) const {
    if (fast_ != nullptr && is_fast(object.handle())) return std::numeric_limits<double>::infinity();
    return reach_;
  }

  // What a query that asks for the objects in a box or, where there is one, in a ball with those bounds, asks of the
  // grid of objects().
  GridRegion region(const Aabbd& bounds, const std::optional<Balld>& ball) const;
  // visit(GridRef) for the objects in such a box or ball: those of which ask(visit) gives what region() names, and
  // others that moved far.
  template <class Ask, class Visit>
  void visit_asked(const Aabbd& bounds, Work& work, const Ask& ask, const Visit& visit) const;
  // As GridSnapshot's, of objects() where they are at this moment.
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
  // visit() of fast movers whose whole way might_meet(bounds); false once visit() was.
  template <class MightMeet, class Visit>
  bool visit_fast(const MightMeet& might_meet, Work& work, const Visit& visit) const;

  const ObjectSet* at_;
  const ObjectSet* next_ = nullptr;
  double weight_ = 0;
  double reach_ = 0;                              // how far from its place in at_ an object may be
  const std::vector<FastMover>* fast_ = nullptr;  // but for these, ascending by handle
};

// What the snapshot keeps of that time; nothing before its oldest tick and after its own. O(log records).
std::optional<SceneAtTime> find_scene_at(const SceneSnapshot& snapshot, const AsOf& time);
// `time`, or the nearest one that find_moment() finds.
AsOf nearest_kept(const SceneSnapshot& snapshot, const AsOf& time);

template <class MightMeet, class Visit>
bool SceneAtTime::visit_fast(const MightMeet& might_meet, Work& work, const Visit& visit) const {
  for (const FastMover& mover : *fast_) {
    ++work.cells;
    const double growth = internal::kBoundsGrowth * (magnitude(mover.centers) + double{mover.reach});
    if (!might_meet(grown(mover.centers, double{mover.reach} + growth))) continue;
    ++work.tests;
    if (!visit(at_->grid().at(mover.handle))) return false;
  }
  return true;
}

template <class Ask, class Visit>
void SceneAtTime::visit_asked(const Aabbd& bounds, Work& work, const Ask& ask, const Visit& visit) const {
  if (fast_ == nullptr) return ask(visit);
  if (!visit_fast([&bounds](const Aabbd& way) { return overlaps(way, bounds); }, work, visit)) return;
  ask([&](const GridRef& object) { return is_fast(object.handle()) || visit(object); });
}

template <class Limit, class Visit>
void SceneAtTime::visit_ray(const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit) const {
  if (next_ == nullptr) return at_->grid().visit_ray(ray, limit, work, visit);
  const double reach = planted(PlantedBug::kRewindReach) ? 0 : reach_;
  if (fast_ == nullptr) return at_->grid().visit_ray(ray, limit, work, visit, reach);
  const auto might_meet = [&](const Aabbd& bounds) {
    const Interval<double> part = ray.interval(bounds);
    return part.near <= part.far && part.far >= 0 && part.near <= limit();
  };
  if (!visit_fast(might_meet, work, visit)) return;
  at_->grid().visit_ray(
      ray, limit, work, [&](const GridRef& object) { return is_fast(object.handle()) || visit(object); }, reach);
}

template <class Limit, class Visit>
void SceneAtTime::visit_nearest(const Vec3d& point, const Limit& limit, Work& work, const Visit& visit) const {
  if (next_ == nullptr) return at_->grid().visit_nearest(point, limit, work, visit);
  const double reach = planted(PlantedBug::kRewindReach) ? 0 : reach_;
  const auto wider = [&limit, reach] { return squared_limit(std::sqrt(limit()) + reach) * (1 + 0x1p-40); };
  if (fast_ == nullptr) return at_->grid().visit_nearest(point, wider, work, visit);
  const auto might_meet = [&](const Aabbd& bounds) { return squared_distance(point, bounds) <= limit(); };
  if (!visit_fast(might_meet, work, visit)) return;
  at_->grid().visit_nearest(point, wider, work,
                            [&](const GridRef& object) { return is_fast(object.handle()) || visit(object); });
}

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SCENE_AT_TIME_H_
