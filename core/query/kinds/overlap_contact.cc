#include "core/query/kinds/overlap_contact.h"

#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/geometry/nearest_pair.h"
#include "core/geometry/sweep.h"
#include "core/query/kinds/placed_triangle.h"

namespace locus {

Contact overlap_contact(const Mover& solid, Precision precision, const Hit& row, uint32_t triangle) {
  Hit hit = row;
  if (hit.object) hit.triangle = triangle;
  if (precision == Precision::kConservative) {
    Aabbd bounds;
    if (hit.object)
      bounds = bounds_of(hit.object_shape());
    else if (triangle == kNoTriangle)
      bounds = hit.instance->bounds;
    else
      bounds = PlacedTriangles(*hit.instance).bounds_of_triangle(hit.instance->mesh->triangle(triangle));
    const Vec3d center = (bounds.min + bounds.max) * 0.5 - solid.start;
    const NearestPair pair = nearest_to_box(solid.half_axis, center, bounds.extent() * 0.5);
    const double distance = solid.kind == MoverKind::kBox ? 0 : std::sqrt(pair.squared_distance);
    return {distance, pair.on_primitive, {}};
  }
  if (hit.object) return contact_at(solid, hit.object_shape(), 0);
  // The batch ended before the nearest triangle was found.
  if (triangle == kNoTriangle) return {};
  const Transform& transform = hit.instance->transform;
  Contact contact = contact_at(mover_to_mesh(solid, transform), corners_of(hit.instance->mesh->triangle(triangle)), 0);
  contact.distance *= double{transform.scale};
  contact.point = transform.rotation.to_world(contact.point) * double{transform.scale};
  contact.normal = normalized(transform.rotation.to_world(contact.normal));
  return contact;
}

uint32_t nearest_part(const Mover& solid, Precision precision, const Hit& row, absl::Span<const uint32_t> parts) {
  LOCUS_DCHECK(!parts.empty());
  uint32_t nearest = parts[0];
  float least = std::numeric_limits<float>::infinity();
  for (const uint32_t part : parts) {
    const auto distance = static_cast<float>(overlap_contact(solid, precision, row, part).distance);
    if (!(distance < least)) continue;
    least = distance;
    nearest = part;
  }
  return nearest;
}

}  // namespace locus
