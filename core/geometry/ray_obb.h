// Intersection of a line with a box around the origin, in the box's own axes. The box is closed: a line in the plane of
// a face, along an edge or through a corner touches it. Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_RAY_OBB_H_
#define LOCUS_CORE_GEOMETRY_RAY_OBB_H_

#include <optional>

#include "core/geometry/chord.h"

namespace locus {

// Returns the chord of the line in the box of half extents `half` >= 0; nullopt if the line misses. Planes that are
// crossed at the same real t give the same rounded quotient, so touching a corner or an edge is exact if the
// differences to the planes are exact. If several faces are crossed at the same t, the normal is that of the first axis
// in the order x, y, z.
std::optional<Chord> chord_of_box(const Line& line, Vec3d half);

bool box_contains(Vec3d half, Vec3d point);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_OBB_H_
