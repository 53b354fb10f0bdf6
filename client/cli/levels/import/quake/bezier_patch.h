// Tessellation of the biquadratic Bezier patches of Quake 3 levels, such that neighbouring patches meet without cracks.
// Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BEZIER_PATCH_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BEZIER_PATCH_H_

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace locus::cli {

using PatchPoint = std::array<double, 3>;

// Grid of width x height points, stored row by row.
struct PatchGrid {
  size_t width = 0;
  size_t height = 0;
  std::vector<PatchPoint> points;
};

// Returns the point at parameter step / steps, 0 <= step <= steps, of the quadratic Bezier curve with control points a,
// b, c. If the control points are floats, the result is bit for bit equal to the point at steps - step of the reversed
// curve c, b, a. The reason: the weighted control points are exact in double, and the weighted a and c are added first,
// so swapping a and c changes no rounding.
PatchPoint bezier_curve_point(const PatchPoint& a, const PatchPoint& b, const PatchPoint& c, int step, int steps);

// Tessellates a grid of width x height control points, stored row by row; width and height are odd and at least 3. The
// grid is made up of patches of 3 x 3 control points, and neighbouring patches share a row or column of points. Each
// patch becomes subdivisions * subdivisions quads. A point on the border of a patch is computed only from the three
// control points of that border, so two patches with equal border control points meet exactly, even if one patch
// stores them in reverse order. Source of the method: Farin, Curves and Surfaces for CAGD, 2002 (tensor product
// patches).
PatchGrid tessellate_patch(std::span<const PatchPoint> controls, size_t width, size_t height, int subdivisions);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BEZIER_PATCH_H_
