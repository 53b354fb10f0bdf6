// Intersection of a line with a capsule around the origin: all points within `radius` of the segment from -half_axis to
// half_axis. The capsule is closed; with a zero half axis it is a ball, with a zero radius a segment. Pure functions;
// any thread.
#ifndef LOCUS_CORE_GEOMETRY_RAY_CAPSULE_H_
#define LOCUS_CORE_GEOMETRY_RAY_CAPSULE_H_

#include <optional>

#include "core/geometry/chord.h"

namespace locus {

// Returns the union of the chords of both end balls and of the cylinder between them: one chord, since a capsule is
// convex.
std::optional<Chord> chord_of_capsule(const Line& line, Vec3d half_axis, double radius);

bool capsule_contains(Vec3d half_axis, double radius, Vec3d point);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_CAPSULE_H_
