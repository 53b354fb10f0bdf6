#include "client/cli/extras/render/framing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace locus::cli {
namespace {

// A box is treated as a point if its longest side is at most this share of its largest absolute coordinate.
constexpr double kSmallestExtent = 1e-9;

std::array<Vec3d, 8> corners_of(const Aabbd& box) {
  std::array<Vec3d, 8> corners;
  for (unsigned i = 0; i < corners.size(); ++i) {
    corners[i] = {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z};
  }
  return corners;
}

// Maxima over all corners of a box. A corner is (x, y, z) in the view's axes (right, up, forward) relative to the box's
// centre. w and h are half the width and half the height of the picture at distance 1; both are 0 for orthographic
// projection. `right` is the maximum of x - w z, `left` of -x - w z, `up` of y - h z, `down` of -y - h z, `near` of -z.
struct Reach {
  double right = -std::numeric_limits<double>::infinity();
  double left = right, up = right, down = right, near = right;
};

Reach reach_of(const Aabbd& box, Vec3d centre, const ViewAxes& axes, double slope_x, double slope_y) {
  Reach reach;
  for (const Vec3d corner : corners_of(box)) {
    const Vec3d from_centre = corner - centre;
    const double x = dot(from_centre, axes.right), y = dot(from_centre, axes.up), z = dot(from_centre, axes.forward);
    reach.right = std::max(reach.right, x - slope_x * z);
    reach.left = std::max(reach.left, -x - slope_x * z);
    reach.up = std::max(reach.up, y - slope_y * z);
    reach.down = std::max(reach.down, -y - slope_y * z);
    reach.near = std::max(reach.near, -z);
  }
  return reach;
}

Aabbd with_extent(Aabbd box) {
  if (max_component(box.extent()) > kSmallestExtent * magnitude(box)) return box;
  const Vec3d half = {0.5, 0.5, 0.5};
  return {box.min - half, box.max + half};
}

}  // namespace

Vec3d three_quarter_view(Vec3d up) {
  const Vec3d upward = normalized(up);
  const Vec3d axis = std::abs(upward.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d east = normalized(axis - upward * dot(axis, upward));
  const Vec3d north = cross(upward, east);
  return normalized(east * 0.5 + north * 0.65 - upward * 0.57);
}

Camera frame_box(const Aabbd& bounds, const ViewAxes& axes, const Lens& lens) {
  const Aabbd box = with_extent(bounds);
  const Vec3d centre = (box.min + box.max) * 0.5;
  const bool perspective = lens.projection == Projection::kPerspective;
  const double slope_y = perspective ? lens.half_height : 0;
  const double slope_x = slope_y * lens.aspect;
  const Reach reach = reach_of(box, centre, axes, slope_x, slope_y);
  const double half_width = (reach.right + reach.left) * 0.5 * lens.margin;
  const double half_height = (reach.up + reach.down) * 0.5 * lens.margin;
  Camera camera;
  camera.axes = axes;
  camera.projection = lens.projection;
  camera.half_height = lens.half_height;
  double distance = 0;
  if (perspective) {
    distance = std::max(half_width / slope_x, half_height / slope_y);
  } else {
    distance = reach.near + max_component(box.extent()) * 0.01;
    if (lens.half_height == 0) camera.half_height = std::max(half_height, half_width / lens.aspect);
  }
  camera.eye = centre + axes.right * ((reach.right - reach.left) * 0.5) + axes.up * ((reach.up - reach.down) * 0.5) -
               axes.forward * distance;
  return camera;
}

}  // namespace locus::cli
