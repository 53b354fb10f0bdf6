// Single result of a query: one object, one instance, or one triangle of an instance. Plain data that borrows from the
// snapshot, and for objects from a SceneAtTime; any thread.
#ifndef LOCUS_CORE_QUERY_KINDS_HIT_H_
#define LOCUS_CORE_QUERY_KINDS_HIT_H_

#include <limits>
#include <tuple>

#include "core/base/check.h"
#include "core/base/ids.h"
#include "core/scene/snapshot/scene_at_time.h"
#include "core/scene/statics/instance.h"

namespace locus {

// One row of a result; a default-constructed hit is a miss.
struct Hit {
  float t = std::numeric_limits<float>::infinity();  // multiple of the ray's direction, or distance of a nearest query
  Id id = kNoId;                                     // 0 = a miss
  uint32_t triangle = kNoTriangle;                   // index in the uploaded index list
  GridRef object;                                    // object or instance is set; neither for a miss
  const Instance* instance = nullptr;
  const SceneAtTime* moment = nullptr;  // objects: time at which the object was found; null: as in the snapshot

  // Returns the shape of the object at the time of the hit. Precondition: the hit is on an object.
  Shape object_shape() const {
    LOCUS_DCHECK(static_cast<bool>(object));
    return moment == nullptr ? shape_of(object) : moment->shape(object);
  }
};

// Returns a hit on an object as it is in the snapshot. The second overload returns a hit on an object as it was at
// `moment`, which the hit borrows; the third a hit on an instance.
inline Hit hit_on(const GridRef& object, float t) { return {t, object.entry().id, kNoTriangle, object}; }
inline Hit hit_on(const GridRef& object, float t, const SceneAtTime& moment) {
  return {t, object.entry().id, kNoTriangle, object, nullptr, &moment};
}
inline Hit hit_on(const Instance& instance, float t) { return {t, instance.id, kNoTriangle, GridRef(), &instance}; }

// Returns whether `a` comes before `b` in the order of hits: nearer first, then lower id, then lower triangle.
inline bool nearer(const Hit& a, const Hit& b) {
  return std::tie(a.t, a.id, a.triangle) < std::tie(b.t, b.id, b.triangle);
}

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_HIT_H_
