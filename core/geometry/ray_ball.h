// A line against a ball around the origin of its axes. Closed: a tangent line has a chord of length zero.
#ifndef LOCUS_CORE_GEOMETRY_RAY_BALL_H_
#define LOCUS_CORE_GEOMETRY_RAY_BALL_H_

#include <optional>

#include "core/geometry/chord.h"
#include "core/geometry/ray.h"

namespace locus {

// Where |origin + t * direction|^2 <= squared_radius. The distance of the line is judged by its cross product, which is
// exact for small whole numbers and loses no digits to a far origin as the difference b^2 - 4ac does. A zero direction
// is legal: everything or nothing.
std::optional<Interval<double>> line_in_ball(const Line& line, double squared_radius);

std::optional<Chord> chord_of_ball(const Line& line, double radius);

bool ball_contains(double radius, Vec3d point);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_BALL_H_
