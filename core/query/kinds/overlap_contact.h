// Contacts of balls, capsules and boxes with the objects and triangles that they overlap: distance, nearest point and
// normal. A contact is computed again from the stored object or triangle when a row is written, since a Hit does not
// store it. Pure functions; any thread.
#ifndef LOCUS_CORE_QUERY_KINDS_OVERLAP_CONTACT_H_
#define LOCUS_CORE_QUERY_KINDS_OVERLAP_CONTACT_H_

#include "absl/types/span.h"
#include "core/geometry/mover.h"
#include "core/query/kinds/hit.h"

namespace locus {

// Returns the contact, in world axes, of `solid` with the object or the triangle of a row; for a compound, `triangle`
// is the number of the part. `solid` is the query's ball, capsule or box, represented by a mover that rests. With
// CONSERVATIVE, the result has the distance and the nearest point of the bounds of the object or triangle, or of the
// whole instance if `triangle` is kNoTriangle; the normal is zero. For a box, this distance is 0, and the point is the
// one nearest to the box's centre.
Contact overlap_contact(const Mover& solid, Precision precision, const Hit& row, uint32_t triangle);

// Returns the one of `parts` of the compound of `row` whose contact with `solid` has the least distance; of several,
// the first. Precondition: there are parts.
uint32_t nearest_part(const Mover& solid, Precision precision, const Hit& row, absl::Span<const uint32_t> parts);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OVERLAP_CONTACT_H_
