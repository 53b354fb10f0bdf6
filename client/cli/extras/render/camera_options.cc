#include "client/cli/extras/render/camera_options.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/extras/render/framing.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr double kSceneMargin = 1.04;
constexpr double kThingMargin = 2;  // larger than kSceneMargin, to show the object's surroundings

Vec3d vector_of(const Triple& triple) { return {triple.x, triple.y, triple.z}; }

// Returns the direction that points upward: that of --up, or the scene's.
Vec3d up_of(const CameraOptions& options) { return options.up ? vector_of(*options.up) : options.scene_up; }

// Returns the axes of a view along `forward`. Without --up, in a view along the scene's upward axis, y points upward
// where z is the scene's upward axis, and -z where y is.
absl::StatusOr<ViewAxes> axes_of(const CameraOptions& options, Vec3d forward) {
  absl::StatusOr<ViewAxes> axes = view_axes(forward, up_of(options));
  const Vec3d ahead = options.scene_up.z != 0 ? Vec3d{0, 1, 0} : Vec3d{0, 0, -1};
  if (!axes.ok() && !options.up) axes = view_axes(forward, ahead);
  if (!axes.ok()) return usage_error(absl::StrCat(axes.status().message(), ": give another --eye, --dir or --up"));
  return axes;
}

Lens lens_of(const CameraOptions& options, const ImageSize& size) {
  Lens lens;
  lens.aspect = size.aspect();
  lens.margin = options.at ? kThingMargin : kSceneMargin;
  if (options.orthographic) {
    lens.projection = Projection::kOrthographic;
    lens.half_height = *options.orthographic / 2;
  } else {
    lens.half_height = half_height_of(options.degrees);
  }
  return lens;
}

}  // namespace

std::istream& operator>>(std::istream& in, ImageSize& size) {
  std::string text;
  in >> text;
  const std::pair<std::string, std::string> sides = absl::StrSplit(text, absl::MaxSplits('x', 1));
  const bool good = absl::SimpleAtoi(sides.first, &size.width) && absl::SimpleAtoi(sides.second, &size.height) &&
                    size.width > 0 && size.height > 0;
  if (!good) in.setstate(std::ios::failbit);
  return in;
}

void add_camera_options(CLI::App& command, CameraOptions& options) {
  command.add_option("--at", options.at, "Frame this object or instance [the whole scene]")->type_name("ID");
  add_triple(command, "--eye", options.eye, "Where the picture is taken from [where all of it shows]");
  add_triple(command, "--look-at", options.look_at, "The point in the middle of the picture; with --eye");
  add_triple(command, "--dir", options.direction, "Which way to look [from above and from a side]");
  add_triple(command, "--up", options.up, "Which way is up [the scene's label up, else 0,0,1]");
  command.add_option("--fov", options.degrees, "Degrees between the lower and the upper edge [45]")
      ->type_name("DEGREES")
      ->check(CLI::Range(0.01, 170.0).description(""));
  command
      .add_option("--ortho", options.orthographic,
                  "Orthographic projection: height of the picture in units; 0 = fit what is framed")
      ->type_name("UNITS")
      ->check(CLI::Range(0.0, 1e9).description(""));
}

absl::Status check(const CameraOptions& options) {
  if (options.look_at && options.direction) return usage_error("give --look-at or --dir, not both");
  if (options.look_at && !options.eye) return usage_error("--look-at needs --eye; to frame one thing give --at");
  if (options.look_at && options.at) return usage_error("give --look-at or --at, not both");
  if (options.look_at && vector_of(*options.look_at) == vector_of(*options.eye)) {
    return usage_error("--eye and --look-at are the same point: the view has no direction");
  }
  if (options.direction && vector_of(*options.direction) == Vec3d{}) {
    return usage_error("--dir 0,0,0 is no direction");
  }
  return absl::OkStatus();
}

absl::StatusOr<Camera> camera_of(const CameraOptions& options, const Aabbd& target, const ImageSize& size) {
  const Vec3d up = up_of(options);
  if (up == Vec3d{}) return usage_error("--up 0,0,0 is no direction");
  Vec3d forward = options.direction ? vector_of(*options.direction) : three_quarter_view(up);
  const Vec3d centre = options.look_at ? vector_of(*options.look_at) : (target.min + target.max) * 0.5;
  if (options.eye && !options.direction) forward = centre - vector_of(*options.eye);
  ASSIGN_OR_RETURN(const ViewAxes axes, axes_of(options, forward));
  Camera camera = frame_box(target, axes, lens_of(options, size));
  if (options.eye) camera.eye = vector_of(*options.eye);
  return camera;
}

}  // namespace locus::cli
