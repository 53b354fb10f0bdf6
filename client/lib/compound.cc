#include "client/lib/compound.h"

#include "client/lib/columns.h"

namespace locus::client {

// Returns the entry of the new part: the last entry if it has the same shape, so that the parts keep their order.
v1::Parts& Compound::add(v1::Parts::ShapeCase shape, const Float3& position, const PartOptions& options) {
  const int entries = message_.parts_size();
  const bool same = entries > 0 && message_.parts(entries - 1).shape_case() == shape;
  v1::Parts& parts = same ? *message_.mutable_parts(entries - 1) : *message_.add_parts();
  const int rows_before = parts.positions_size() / 3;
  append_triple(*parts.mutable_positions(), position);
  append_rotation_row(*parts.mutable_rotations(), rows_before, options.rotation);
  append_row<uint32_t>(*parts.mutable_layers(), rows_before, options.layers, kAllLayers);
  return parts;
}

Compound& Compound::ball(const Float3& position, float radius, const PartOptions& options) {
  add(v1::Parts::kBall, position, options).mutable_ball()->add_radii(radius);
  return *this;
}

Compound& Compound::box(const Float3& position, const Float3& half_extents, const PartOptions& options) {
  append_triple(*add(v1::Parts::kBox, position, options).mutable_box()->mutable_half_extents(), half_extents);
  return *this;
}

Compound& Compound::capsule(const Float3& position, const Float3& half_axis, float radius, const PartOptions& options) {
  v1::Capsule& capsule = *add(v1::Parts::kCapsule, position, options).mutable_capsule();
  append_triple(*capsule.mutable_half_axes(), half_axis);
  capsule.add_radii(radius);
  return *this;
}

size_t Compound::size() const {
  size_t parts = 0;
  for (const v1::Parts& entry : message_.parts()) parts += static_cast<size_t>(entry.positions_size()) / 3;
  return parts;
}

bool Compound::has_layers() const {
  for (const v1::Parts& entry : message_.parts()) {
    if (entry.layers_size() > 0) return true;
  }
  return false;
}

}  // namespace locus::client
