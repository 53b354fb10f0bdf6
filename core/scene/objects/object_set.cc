#include "core/scene/objects/object_set.h"

#include <cmath>
#include <limits>

#include "core/base/check.h"

namespace locus {
namespace {

// Returns a float that is at least `length`.
float at_least(double length) {
  return std::nextafter(static_cast<float>(length), std::numeric_limits<float>::infinity());
}

// Returns the extent of the shape: an upper bound of the distance from its position to any of its points, under any
// rotation. The extent does not depend on the current rotation, so a rotation never moves an object to another cell.
float extent_of(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::kPoint:
      return 0;
    case ShapeKind::kBall:
      return shape.radius;
    case ShapeKind::kBox:
      return at_least(std::sqrt(squared_length(to_double(shape.size))));
    case ShapeKind::kCapsule:
      return at_least(std::sqrt(squared_length(to_double(shape.size))) + shape.radius);
  }
  return 0;
}

}  // namespace

Shape shape_of(const GridRef& value) {
  const GridForm form = value.form();
  const ShapeKind kind = value.entry().kind;
  const float radius = kind == ShapeKind::kBall ? value.reach() : form.radius;
  return {kind, value.entry().position, form.rotation, form.size, radius};
}

Object object_of(const GridRef& value) {
  const GridEntry& entry = value.entry();
  return {entry.id, entry.group, entry.tag, entry.layers, shape_of(value)};
}

GridItem grid_item_of(const Object& object, uint32_t handle) {
  LOCUS_DCHECK_NE(handle, PersistentIdTable<>::kNone);
  const Shape& shape = object.shape;
  GridItem item;
  item.entry = {shape.position, object.id, object.group, object.tag, object.layers, shape.kind};
  item.handle = handle;
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
