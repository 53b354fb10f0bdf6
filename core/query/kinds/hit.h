// Result row of a query: one object, one instance, or one triangle of an instance. Plain data that any thread may use.
// Borrows the object or instance from the snapshot, and the SceneAtTime at which an object was found.
#ifndef LOCUS_CORE_QUERY_KINDS_HIT_H_
#define LOCUS_CORE_QUERY_KINDS_HIT_H_

#include <limits>
#include <tuple>

#include "core/base/check.h"
#include "core/base/column.h"
#include "core/base/ids.h"
#include "core/query/query_batch.h"
#include "core/scene/snapshot/scene_at_time.h"
#include "core/scene/statics/instance.h"

namespace locus {

// One row of a result; a default-constructed hit is a miss.
struct Hit {
  // Ray: multiple of the direction. Sweep: multiple of Mover::way. Nearest, pair or cell: distance. Other hits: 0.
  // Miss: infinity.
  float t = std::numeric_limits<float>::infinity();
  Id id = kNoId;                        // id of the object or instance; 0: the hit is a miss
  uint32_t triangle = kNoTriangle;      // index of the triangle in the uploaded mesh, or number of a compound's part
  GridRef object;                       // null for an instance and for a miss
  const Instance* instance = nullptr;   // null for an object and for a miss
  const SceneAtTime* moment = nullptr;  // time at which the object was found; null: the snapshot's latest state

  // Returns the object's shape at the time at which the object was found. For a hit on a part of a compound, returns
  // the shape of the part. Precondition: the hit is on an object.
  Shape object_shape() const {
    const Shape shape = whole_shape();
    if (shape.kind != ShapeKind::kCompound || triangle == kNoTriangle) return shape;
    return PlacedCompound(*compound_of(object), shape.position, shape.rotation).shape(triangle);
  }
  // Returns the object's shape like object_shape(), but for a hit on a part the shape of the whole compound, which has
  // only a position and a rotation.
  Shape whole_shape() const {
    LOCUS_DCHECK(static_cast<bool>(object));
    return moment == nullptr ? shape_of(object) : moment->shape(object);
  }
};

// Return a hit at `t`. The first function returns a hit on an object in the snapshot's latest state. The second returns
// a hit on an object at the time `moment`, which the hit borrows. hit_on_part() returns a hit on a part of a compound.
// The last returns a hit on an instance.
inline Hit hit_on(const GridRef& object, float t) { return {t, object.entry().id, kNoTriangle, object}; }
inline Hit hit_on(const GridRef& object, float t, const SceneAtTime& moment) {
  return {t, object.entry().id, kNoTriangle, object, nullptr, &moment};
}
inline Hit hit_on_part(const GridRef& object, uint32_t part, float t, const SceneAtTime& moment) {
  return {t, object.entry().id, part, object, nullptr, &moment};
}
inline Hit hit_on(const Instance& instance, float t) { return {t, instance.id, kNoTriangle, GridRef(), &instance}; }

// Position in the order of rows (t, id, triangle).
struct RowPosition {
  float t = -std::numeric_limits<float>::infinity();  // below the t of every row
  Id id = std::numeric_limits<Id>::max();
  uint32_t triangle = kNoTriangle;

  // Returns the row position that `columns` give for query `i`. Precondition: `columns` have passed check_batch().
  static RowPosition of(const AfterColumns& columns, size_t i) {
    RowPosition position;
    position.t = ColumnReader<float>(columns.ts, 1).value(i, position.t);
    position.id = ColumnReader<uint64_t>(columns.ids, 1).value(i, position.id);
    position.triangle = ColumnReader<uint32_t>(columns.triangles, 1).value(i, position.triangle);
    return position;
  }
  // Returns false for the default position, which excludes no row.
  bool is_given() const { return t != -std::numeric_limits<float>::infinity(); }
  // Returns whether `hit` comes after this position.
  bool is_before(const Hit& hit) const { return std::tie(t, id, triangle) < std::tie(hit.t, hit.id, hit.triangle); }
};

// Returns whether `a` comes before `b` in the order of hits: nearer first, then lower id, then lower triangle.
inline bool nearer(const Hit& a, const Hit& b) {
  return std::tie(a.t, a.id, a.triangle) < std::tie(b.t, b.id, b.triangle);
}

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_HIT_H_
