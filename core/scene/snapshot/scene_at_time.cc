#include "core/scene/snapshot/scene_at_time.h"

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/geometry/rotation.h"

namespace locus {
namespace {

// Bounds of rounding errors: kEpsilonFactor is a factor for lengths, kPositionEpsilon a distance for interpolated
// positions. Both exceed the rounding errors, which are a few times 2^-52 of the magnitudes.
constexpr double kEpsilonFactor = 1 + 0x1p-36;
constexpr double kPositionEpsilon = limits::kMaxCoordinate * 0x1p-49;

bool before(const AsOf& a, const AsOf& b) { return a.tick < b.tick || (a.tick == b.tick && a.fraction < b.fraction); }

}  // namespace

SceneAtTime::SceneAtTime(const ObjectSet& at, const ObjectSet& next, double weight, const Displacement& displacement,
                         const StaticSet& statics, const StaticSet& next_statics)
    : at_(&at),
      next_(&next),
      weight_(weight),
      displacement_bound_(displacement.bound * weight * kEpsilonFactor + kPositionEpsilon),
      fast_(displacement.fast.get()),
      statics_(&statics),
      next_statics_(&next_statics) {
  if (&statics != &next_statics) between_ = std::make_shared<const InstancesBetween>(statics, next_statics, weight);
  LOCUS_DCHECK(weight >= 0 && weight <= 1);
  LOCUS_DCHECK_GE(displacement.bound, 0.0);
}

GridRegion SceneAtTime::region(const Aabbd& bounds, const std::optional<Balld>& ball) const {
  if (next_ == nullptr) return {&at_->grid(), bounds, ball};
  const double bound = planted(PlantedBug::kRewindReach) ? 0 : displacement_bound_;
  std::optional<Balld> near = ball;
  if (near) near->radius += bound;
  return {&at_->grid(), grown(bounds, bound), near, &next_->grid()};
}

Shape SceneAtTime::shape_between(const GridRef& object) const {
  Shape shape = shape_of(object);
  const GridRef later = next_->grid().find_like(object);
  if (!later) return shape;
  shape.position = shape.position + (later.entry().position - shape.position) * weight_;
  shape.rotation = blended(shape.rotation, later.form().rotation, weight_);
  return shape;
}

std::optional<SceneAtTime> find_scene_at(const SceneSnapshot& snapshot, const AsOf& time) {
  const AsOf now{snapshot.tick, 0};
  if (time == now) return SceneAtTime(snapshot.objects, *snapshot.statics);
  if (before(now, time) || time.tick < snapshot.oldest_tick()) return std::nullopt;
  const auto& records = snapshot.history->records;
  const auto next = std::upper_bound(records.begin(), records.end(), time.tick,
                                     [](uint64_t tick, const auto& record) { return tick < record->tick; });
  LOCUS_DCHECK(next != records.begin());
  const HistoryRecord& at = **(next - 1);
  const StaticSet& statics = planted(PlantedBug::kPastInstances) ? *snapshot.statics : *at.statics;
  if (time == AsOf{at.tick, 0}) return SceneAtTime(at.objects, statics);
  const bool last = next == records.end();
  const uint64_t next_tick = last ? snapshot.tick : (*next)->tick;
  LOCUS_DCHECK_LT(at.tick, next_tick);
  const double weight =
      (static_cast<double>(time.tick - at.tick) + double{time.fraction}) / static_cast<double>(next_tick - at.tick);
  return SceneAtTime(at.objects, last ? snapshot.objects : (*next)->objects, weight,
                     last ? snapshot.since_close : at.to_next, statics, last ? *snapshot.statics : *(*next)->statics);
}

AsOf nearest_kept(const SceneSnapshot& snapshot, const AsOf& time) {
  if (time.tick < snapshot.oldest_tick()) return {snapshot.oldest_tick(), 0};
  const AsOf now{snapshot.tick, 0};
  return before(now, time) ? now : time;
}

}  // namespace locus
