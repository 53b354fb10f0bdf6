#include "core/scene/objects/object_set.h"

#include "core/base/check.h"

namespace locus {
Shape shape_of(const GridRef& value) {
  const GridForm form = value.form();
  const ShapeKind kind = value.entry().kind;
  if (kind == ShapeKind::kCompound) return {kind, value.entry().position, form.rotation, {}, 0};
  const float radius = kind == ShapeKind::kBall ? value.reach() : form.radius;
  return {kind, value.entry().position, form.rotation, form.size, radius};
}

Object object_of(const GridRef& value) {
  const GridEntry& entry = value.entry();
  return {entry.id, entry.group, entry.tag, entry.layers, shape_of(value), compound_of(value)};
}

const Compound* compound_of(const GridRef& value) {
  return value.entry().kind == ShapeKind::kCompound ? value.form().compound() : nullptr;
}

Aabbd bounds_of(const GridRef& value, const Shape& shape) {
  if (shape.kind != ShapeKind::kCompound) return bounds_of(shape);
  return PlacedCompound(*compound_of(value), shape.position, shape.rotation).bounds();
}

GridItem grid_item_of(const Object& object, uint32_t handle) {
  LOCUS_DCHECK_NE(handle, PersistentIdTable<>::kNone);
  const Shape& shape = object.shape;
  GridItem item;
  item.entry = {shape.position, object.id, object.group, object.tag, object.layers, shape.kind};
  item.handle = handle;
  if (object.compound != nullptr) {
    item.reach = object.compound->extent();
    item.form = GridForm::of_compound(shape.rotation, object.compound);
    return item;
  }
  item.reach = extent_of(shape);
  item.form = {shape.rotation, shape.size, shape.kind == ShapeKind::kBall ? 0 : shape.radius};
  return item;
}

GridRef ObjectSet::find_ref(Id id) const {
  const uint32_t handle = handles_.find(id);
  if (handle == PersistentIdTable<>::kNone) return GridRef();
  const GridRef object = grid_.at(handle);
  LOCUS_DCHECK(!object || object.entry().id == id);
  return object;
}

std::optional<Object> ObjectSet::find(Id id) const {
  const GridRef value = find_ref(id);
  return value ? std::optional<Object>(object_of(value)) : std::nullopt;
}

}  // namespace locus
