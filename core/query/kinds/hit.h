// What a query found: one object, one instance, or one triangle of an instance. Plain data that borrows from the
// snapshot.
#ifndef LOCUS_CORE_QUERY_KINDS_HIT_H_
#define LOCUS_CORE_QUERY_KINDS_HIT_H_

#include <limits>
#include <tuple>

#include "core/base/ids.h"
#include "core/scene/snapshot/scene_at_time.h"
#include "core/scene/statics/instance.h"

namespace locus {

struct Hit {
  float t = std::numeric_limits<float>::infinity();  // in units of the ray's direction
  Id id = kNoId;                                     // 0 = a miss
  uint32_t triangle = kNoTriangle;                   // number in the mesh
  GridRef object;                                    // one of the two, or neither for a miss
  const Instance* instance = nullptr;
  const SceneAtTime* moment = nullptr;  // of the object: when it was found

  Shape object_shape() const { return moment == nullptr ? shape_of(object) : moment->shape(object); }
};

// As it is in the snapshot; the next, as it was at a moment, which the hit borrows.
inline Hit hit_on(const GridRef& object, float t) { return {t, object.entry().id, kNoTriangle, object}; }
inline Hit hit_on(const GridRef& object, float t, const SceneAtTime& moment) {
  return {t, object.entry().id, kNoTriangle, object, nullptr, &moment};
}
inline Hit hit_on(const Instance& instance, float t) { return {t, instance.id, kNoTriangle, GridRef(), &instance}; }

// The order of ray hits: nearer first, then lower id, then lower triangle.
inline bool nearer(const Hit& a, const Hit& b) {
  return std::tie(a.t, a.id, a.triangle) < std::tie(b.t, b.id, b.triangle);
}

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_HIT_H_
