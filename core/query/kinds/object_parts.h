// Parts of compounds, as queries see them: ordinary shapes in world axes. Free functions; any thread.
#ifndef LOCUS_CORE_QUERY_KINDS_OBJECT_PARTS_H_
#define LOCUS_CORE_QUERY_KINDS_OBJECT_PARTS_H_

#include "core/geometry/compound.h"
#include "core/scene/snapshot/scene_at_time.h"

namespace locus {

// Returns whether queries must look at the parts of an object, and not at its shape.
inline bool has_parts(const GridRef& object) { return object.entry().kind == ShapeKind::kCompound; }

// Calls fn(PlacedCompound::PlacedPart) for each part of a compound that is in one of `layers`, in order and at the time
// `moment`, until fn() returns false. Returns false if it did. The layers of the object and of its parts must both
// contain the layer. Precondition: has_parts(object).
template <class Fn>
bool for_each_part(const SceneAtTime& moment, const GridRef& object, Layers layers, const Fn& fn) {
  const Shape shape = moment.shape(object);
  const PlacedCompound placed(*compound_of(object), shape.position, shape.rotation);
  return placed.for_each(layers & object.entry().layers, fn);
}

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OBJECT_PARTS_H_
