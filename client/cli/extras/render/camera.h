// Camera of a picture, and the ray through the centre of each pixel. For `locus render`. Plain data and functions
// without state; threads may share a camera.
//
// The rays are bit-identical on every machine: they are computed in double with only +, -, *, / and square roots, and
// then rounded to float once. The only other function is the tangent of half the angle of view. Math libraries differ
// in its last bits, so it is rounded to float immediately, which hides the difference.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAMERA_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAMERA_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/geometry/vec3.h"

namespace locus::cli {

struct ImageSize {
  uint32_t width = 0;
  uint32_t height = 0;

  uint64_t pixels() const { return uint64_t{width} * height; }
  double aspect() const { return static_cast<double>(width) / height; }
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

enum class Projection { kPerspective, kOrthographic };

// Axes of the view: perpendicular unit vectors. The system (right, up, -forward) is right-handed.
struct ViewAxes {
  Vec3d right;
  Vec3d up;
  Vec3d forward;
};

struct Camera {
  Vec3d eye;  // position in world coordinates
  ViewAxes axes;
  Projection projection = Projection::kPerspective;
  // Half the height of the image in world units. With perspective projection this is half the height at distance 1 from
  // the eye; with orthographic projection it is the same at every distance.
  double half_height = 1;
};

struct CameraRay {
  Vec3f origin;  // relative to the eye; 0 in perspective projection
  // Direction, scaled so that its component along the view's forward axis is 1. Therefore the t of a hit is its depth:
  // the distance in world units from the plane through the eye that is perpendicular to the forward axis.
  Vec3f direction;
};

// Returns the axes of a view in direction `forward`, such that `up` points upward in the image. Both vectors may have
// any length. Returns INVALID_ARGUMENT if either is zero or not finite, or if they are parallel (sine of their angle
// below 1e-6).
absl::StatusOr<ViewAxes> view_axes(Vec3d forward, Vec3d up);

// Returns half the image's height at distance 1 for a vertical angle of view of `degrees`, 0 < degrees < 180.
double half_height_of(double degrees);

// Returns the ray through the centre of a pixel. Row 0 is the uppermost row.
CameraRay ray_through(const Camera& camera, const ImageSize& size, uint32_t column, uint32_t row);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAMERA_H_
