// Overlap tests of triangles with balls and boxes in mesh axes, computed in double from the stored floats. A triangle
// is a closed surface: touching counts. A triangle without area is a segment or a point. Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_TRIANGLE_OVERLAP_H_
#define LOCUS_CORE_GEOMETRY_TRIANGLE_OVERLAP_H_

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/geometry/point_triangle.h"

namespace locus {

// Returns whether the triangle's squared_distance() from the ball's centre is at most radius^2 and the ball reaches()
// the triangle's own bounds.
bool ball_overlaps(const Ballf& ball, const Triangle& triangle);

// Returns whether the triangle's own bounds overlap bounds_of(box) and no axis separates triangle and box: separating
// axis test over 13 axes, in the box's own axes. Source: Akenine-Moller, Fast 3D Triangle-Box Overlap Testing, 2001.
bool box_overlaps(const Obbf& box, const Triangle& triangle);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_TRIANGLE_OVERLAP_H_
