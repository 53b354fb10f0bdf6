// Triangles against balls and boxes in mesh axes, decided in double from the stored floats. A triangle is a closed
// surface: touching counts, and triangles without area count as the segment or point they are.
#ifndef LOCUS_CORE_GEOMETRY_TRIANGLE_OVERLAP_H_
#define LOCUS_CORE_GEOMETRY_TRIANGLE_OVERLAP_H_

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/geometry/point_triangle.h"

namespace locus {

// squared_distance() <= radius^2, and the triangle's own box is no farther than that either.
bool ball_overlaps(const Ballf& ball, const Triangle& triangle);

// Separating axis test over 13 axes in the box's own axes, and the triangle's own box overlaps the bounds of `box`.
// Source: Akenine-Moller, Fast 3D Triangle-Box Overlap Testing, 2001.
bool box_overlaps(const Obbf& box, const Triangle& triangle);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_TRIANGLE_OVERLAP_H_
