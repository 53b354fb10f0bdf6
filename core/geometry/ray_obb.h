// A line against a box around the origin of its axes, which are the box's own. Closed: a line within the plane of a
// face, along an edge or through a corner touches.
#ifndef LOCUS_CORE_GEOMETRY_RAY_OBB_H_
#define LOCUS_CORE_GEOMETRY_RAY_OBB_H_

#include <optional>

#include "core/geometry/chord.h"

namespace locus {

// `half` >= 0. Two planes met at the same real t give the same rounded quotient, so that touching a corner or an edge
// is judged exactly wherever the differences to the planes are. Where several faces are met at once the normal is that
// of the lowest axis.
std::optional<Chord> chord_of_box(const Line& line, Vec3d half);

bool box_contains(Vec3d half, Vec3d point);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_OBB_H_
