// Where a picture is taken from, and the ray through each of its pixels. For `locus render`. Plain data and functions
// without state; threads may share a camera.
//
// The rays are the same bits on every machine: double arithmetic of +, -, *, / and square roots, rounded to float once.
// The one tangent, of the angle of view, is rounded to float as soon as it is taken.
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

// The view's axes: unit, perpendicular to each other, right-handed as right, up, backward.
struct ViewAxes {
  Vec3d right;
  Vec3d up;
  Vec3d forward;
};

struct Camera {
  Vec3d eye;  // world
  ViewAxes axes;
  Projection projection = Projection::kPerspective;
  // Of the image: at distance 1 (perspective), or in world units at any distance (orthographic).
  double half_height = 1;
};

struct CameraRay {
  Vec3f origin;  // relative to the eye; 0 in perspective
  // Of length 1 along the view, so that a hit's t is its depth: the distance from the eye's plane, in world units.
  Vec3f direction;
};

// Axes that look along `forward` (any length) with `up` (any length) upward in the image. INVALID_ARGUMENT if either is
// zero or not finite, or if they are parallel within 1e-6.
absl::StatusOr<ViewAxes> view_axes(Vec3d forward, Vec3d up);

// Half the image's height at distance 1 for an angle of view of 0 < degrees < 180 from its lower to its upper edge.
double half_height_of(double degrees);

// Through the centre of a pixel. Row 0 is the uppermost.
CameraRay ray_through(const Camera& camera, const ImageSize& size, uint32_t column, uint32_t row);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAMERA_H_
