// A line against a capsule around the origin of its axes: all points within `radius` of the segment from -half_axis to
// half_axis. Closed; a zero half axis makes it a ball, a zero radius a segment.
#ifndef LOCUS_CORE_GEOMETRY_RAY_CAPSULE_H_
#define LOCUS_CORE_GEOMETRY_RAY_CAPSULE_H_

#include <optional>

#include "core/geometry/chord.h"

namespace locus {

// The union of the chords of two balls and of the cylinder between them, which is one chord since a capsule is convex.
std::optional<Chord> chord_of_capsule(const Line& line, Vec3d half_axis, double radius);

bool capsule_contains(Vec3d half_axis, double radius, Vec3d point);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_CAPSULE_H_
