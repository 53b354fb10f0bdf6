// The options of `locus render` that say where the picture is taken from, and the camera they mean.
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
  double degrees = 45;
  std::optional<double> orthographic =
      std::nullopt;  // units from the lower to the upper edge; 0 = what the target takes
  std::optional<Number64> at = std::nullopt;
};

// "640x360". Fails on anything else, and on a side of 0.
std::istream& operator>>(std::istream& in, ImageSize& size);

void add_camera_options(CLI::App& command, CameraOptions& options);

// Usage errors that need no server: options that contradict each other or give no direction.
absl::Status check(const CameraOptions& options);

// `target`: bounds of what the picture is of, not empty. Usage error if the view has no direction or --up is parallel
// to it.
absl::StatusOr<Camera> camera_of(const CameraOptions& options, const Aabbd& target, const ImageSize& size);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAMERA_OPTIONS_H_
