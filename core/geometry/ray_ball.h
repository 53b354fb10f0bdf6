// Intersection of a line with a ball around the origin. The ball is closed: a tangent has a chord of length zero. Pure
// functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_RAY_BALL_H_
#define LOCUS_CORE_GEOMETRY_RAY_BALL_H_

#include <optional>

#include "core/geometry/chord.h"
#include "core/geometry/ray.h"

namespace locus {

// Returns the interval of t with |origin + t * direction|^2 <= squared_radius; nullopt if it is empty. The distance
// from the line to the ball's centre is computed by a cross product: exact for small integers and, unlike b^2 - 4ac,
// without cancellation for far origins. A zero direction is legal: the interval is then infinite or empty.
std::optional<Interval<double>> line_in_ball(const Line& line, double squared_radius);

// Returns the chord of the line in the ball of the given radius; nullopt if the line misses.
std::optional<Chord> chord_of_ball(const Line& line, double radius);

bool ball_contains(double radius, Vec3d point);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_BALL_H_
