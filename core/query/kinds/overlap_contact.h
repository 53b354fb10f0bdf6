// Contacts of balls and capsules with the objects and triangles that they overlap: distance, nearest point and normal.
// Computed again from the stored object or triangle when a row is written, since a Hit does not store them. Pure
// functions; any thread.
#ifndef LOCUS_CORE_QUERY_KINDS_OVERLAP_CONTACT_H_
#define LOCUS_CORE_QUERY_KINDS_OVERLAP_CONTACT_H_

#include "core/geometry/mover.h"
#include "core/query/kinds/hit.h"

namespace locus {

// Returns the contact of a ball or capsule, as a mover that rests, with the object or the triangle of a row, in world
// axes: see Contact. With CONSERVATIVE, the distance and the nearest point of its bounds, or of the bounds of the
// instance if `triangle` is kNoTriangle; the normal is then zero.
Contact overlap_contact(const Mover& solid, Precision precision, const Hit& hit, uint32_t triangle);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OVERLAP_CONTACT_H_
