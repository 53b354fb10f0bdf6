#include "client/cli/extras/render/camera.h"

#include <cmath>
#include <numbers>

#include "absl/status/status.h"

namespace locus::cli {
namespace {

constexpr double kParallel = 1e-6;  // directions count as parallel if the sine of the angle between them is smaller

bool is_direction(Vec3d v) { return is_finite(v) && max_component(abs(v)) > 0; }

}  // namespace

absl::StatusOr<ViewAxes> view_axes(Vec3d forward, Vec3d up) {
  if (!is_direction(forward)) return absl::InvalidArgumentError("the view has no direction");
  if (!is_direction(up)) return absl::InvalidArgumentError("up has no direction");
  ViewAxes axes;
  axes.forward = normalized(forward);
  const Vec3d right = cross(axes.forward, normalized(up));
  if (!(std::sqrt(squared_length(right)) > kParallel)) {
    return absl::InvalidArgumentError("up is parallel to the view");
  }
  axes.right = normalized(right);
  axes.up = cross(axes.right, axes.forward);
  return axes;
}

double half_height_of(double degrees) {
  // Round to float: math libraries differ in the last bits of a tangent, and rounding hides the difference.
  return static_cast<float>(std::tan(degrees * (std::numbers::pi / 360)));
}

CameraRay ray_through(const Camera& camera, const ImageSize& size, uint32_t column, uint32_t row) {
  const double x = (2.0 * column + 1 - size.width) / size.height * camera.half_height;
  const double y = (size.height - 1 - 2.0 * row) / size.height * camera.half_height;
  const Vec3d offset = camera.axes.right * x + camera.axes.up * y;
  if (camera.projection == Projection::kOrthographic) return {to_float(offset), to_float(camera.axes.forward)};
  return {{}, to_float(camera.axes.forward + offset)};
}

}  // namespace locus::cli
