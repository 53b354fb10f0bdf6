// Options of `locus render` that describe the camera, and a function that makes the camera from these options. Plain
// data and functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAMERA_OPTIONS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAMERA_OPTIONS_H_

#include <istream>
#include <optional>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/arguments.h"
#include "client/cli/extras/render/camera.h"
#include "core/geometry/aabb.h"

namespace locus::cli {

struct CameraOptions {
  std::optional<Triple> eye = std::nullopt;
  std::optional<Triple> look_at = std::nullopt;
  std::optional<Triple> direction = std::nullopt;
  std::optional<Triple> up = std::nullopt;
  Vec3d scene_up = {0, 0, 1};  // used without `up`
  double degrees = 45;
  std::optional<double> orthographic = std::nullopt;  // image height in world units; 0 = chosen to fit
  std::optional<Number64> at = std::nullopt;
};

// Parses a size such as "640x360". Sets failbit on any other form, and if either side is 0.
std::istream& operator>>(std::istream& in, ImageSize& size);

void add_camera_options(CLI::App& command, CameraOptions& options);

// Returns a usage error if options contradict each other or do not determine the direction of the view. Sends nothing.
absl::Status check(const CameraOptions& options);

// Returns the camera that the options describe. `target` is the bounding box that the picture must show; it must not be
// empty. Returns a usage error if the direction of the view is undefined or parallel to --up.
absl::StatusOr<Camera> camera_of(const CameraOptions& options, const Aabbd& target, const ImageSize& size);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAMERA_OPTIONS_H_
