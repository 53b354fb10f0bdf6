#include "client/cli/levels/import/quake/bezier_patch.h"

namespace locus::cli {

PatchPoint bezier_curve_point(const PatchPoint& a, const PatchPoint& b, const PatchPoint& c, int step, int steps) {
  // Return end points unchanged. A point on a patch's border is then rounded only by the calculation along the border,
  // not by the calculation across it.
  if (step == 0) return a;
  if (step == steps) return c;
  const double rest = steps - step;
  const double weight_a = rest * rest;
  const double weight_b = 2.0 * rest * step;
  const double weight_c = static_cast<double>(step) * step;
  const double weight_sum = static_cast<double>(steps) * steps;
  PatchPoint point;
  for (size_t axis = 0; axis < 3; ++axis) {
    // Add the terms of the two end points first. Swapping the end points does not change this sum, so the reversed
    // curve is rounded identically.
    point[axis] = ((a[axis] * weight_a + c[axis] * weight_c) + b[axis] * weight_b) / weight_sum;
  }
  return point;
}

PatchGrid tessellate_patch(std::span<const PatchPoint> controls, size_t width, size_t height, int subdivisions) {
  const auto steps = static_cast<size_t>(subdivisions);
  PatchGrid grid;
  grid.width = (width - 1) / 2 * steps + 1;
  grid.height = (height - 1) / 2 * steps + 1;
  grid.points.reserve(grid.width * grid.height);
  for (size_t y = 0; y < grid.height; ++y) {
    // A row of control points that two patches share is evaluated as the last row (step `steps`) of the first patch.
    const size_t patch_y = y == 0 ? 0 : (y - 1) / steps;
    const int step_y = static_cast<int>(y - patch_y * steps);
    for (size_t x = 0; x < grid.width; ++x) {
      const size_t patch_x = x == 0 ? 0 : (x - 1) / steps;
      const int step_x = static_cast<int>(x - patch_x * steps);
      std::array<PatchPoint, 3> column;
      for (size_t row = 0; row < 3; ++row) {
        const PatchPoint* control = &controls[(2 * patch_y + row) * width + 2 * patch_x];
        column[row] = bezier_curve_point(control[0], control[1], control[2], step_x, subdivisions);
      }
      grid.points.push_back(bezier_curve_point(column[0], column[1], column[2], step_y, subdivisions));
    }
  }
  return grid;
}

}  // namespace locus::cli
