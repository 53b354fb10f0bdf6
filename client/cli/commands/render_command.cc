#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "client/cli/arguments.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/commands/scene_up.h"
#include "client/cli/default_scene.h"
#include "client/cli/extras/render/camera_options.h"
#include "client/cli/extras/render/cast_rays.h"
#include "client/cli/extras/render/paint.h"
#include "client/cli/extras/render/picture.h"
#include "client/cli/extras/render/thing_bounds.h"
#include "client/cli/failure.h"
#include "client/cli/progress.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr uint64_t kMaxRenderRays = uint64_t{1} << 24;  // limits memory: 28 bytes per ray, 52 if work is reported
constexpr ImageSize kDefaultSize = {960, 540};
constexpr ImageSize kDefaultHeatSize = {480, 270};  // smaller, since rays take longer if their work is reported

enum class Show { kShaded, kDepth, kNormals, kIds };
enum class Heat { kNone, kWork, kNodes, kCells, kTests };
enum class Samples { kOne = 1, kFour = 4 };

struct RenderOptions {
  std::string out;
  CameraOptions camera;
  ImageSize size;  // 0 = kDefaultSize or kDefaultHeatSize
  Show show = Show::kShaded;
  Heat heat = Heat::kNone;
  Samples samples = Samples::kOne;
  Number64 mask = {0xFFFFFFFFu};
  bool live = false;
  CastOptions cast;
};

// Returns the number n of rays along each side of a pixel; a pixel has n * n rays.
uint32_t rays_a_side(const RenderOptions& options) { return options.samples == Samples::kFour ? 2 : 1; }

ImageSize picture_size(const RenderOptions& options) {
  if (options.size.width > 0) return options.size;
  return options.heat == Heat::kNone ? kDefaultSize : kDefaultHeatSize;
}

absl::StatusOr<ImageSize> ray_image_size(const RenderOptions& options) {
  const ImageSize size = picture_size(options);
  const uint64_t rays_a_pixel = uint64_t{rays_a_side(options)} * rays_a_side(options);
  // The products cannot overflow: width and height have 32 bits, and the second product is computed only if the first
  // is at most kMaxRenderRays.
  if (size.pixels() > kMaxRenderRays || size.pixels() * rays_a_pixel > kMaxRenderRays) {
    return usage_error(absl::StrCat("--size ", size.width, "x", size.height, " with --samples ", rays_a_pixel,
                                    " takes more rays than a picture may have (", kMaxRenderRays,
                                    "): give a smaller one"));
  }
  return ImageSize{size.width * rays_a_side(options), size.height * rays_a_side(options)};
}

absl::Status check_line(const RenderOptions& options) {
  RETURN_IF_ERROR(check(options.camera));
  RETURN_IF_ERROR(ray_image_size(options).status());
  return check_png_path(options.out);
}

// Returns the bounds of what the picture must show: the object or instance given by --at, or the whole scene. Sets
// options.cast.revision to the scene's current revision, and options.camera.scene_up to its upward axis.
absl::StatusOr<Aabbd> find_target(RenderOptions& options, const client::Client& client) {
  ASSIGN_OR_RETURN(const v1::Scene scene, client.get_scene(options.cast.scene));
  options.cast.revision = {scene.epoch(), scene.revision()};
  if (up_of(scene) == UpAxis::kY) options.camera.scene_up = {0, 1, 0};
  if (!scene.has_min() || !scene.has_max()) {
    return absl::FailedPreconditionError(
        absl::StrCat("scene ", options.cast.scene,
                     " is empty, there is nothing to see: `locus import` and `locus insert` put something in it"));
  }
  const Aabbd bounds = {{scene.min().x(), scene.min().y(), scene.min().z()},
                        {scene.max().x(), scene.max().y(), scene.max().z()}};
  if (!options.camera.at) return bounds;
  return thing_bounds(client, options.cast.scene, options.cast.revision, options.camera.at->value, bounds);
}

std::vector<double> heat_of(const RayImage& image, Heat heat) {
  std::vector<double> values;
  values.reserve(image.work.size());
  for (const RayWork& work : image.work) {
    uint64_t value = work.nodes + work.cells + work.tests;
    if (heat == Heat::kNodes) value = work.nodes;
    if (heat == Heat::kCells) value = work.cells;
    if (heat == Heat::kTests) value = work.tests;
    values.push_back(static_cast<double>(value));
  }
  return values;
}

// Paints the requested kind of picture. Adds to `head` the range of the costs (with --heat) or of the depths
// (otherwise).
Picture paint(const RenderOptions& options, const RayImage& image, const Camera& camera, Json& head) {
  if (options.heat != Heat::kNone) {
    const std::vector<double> values = heat_of(image, options.heat);
    const ValueScale scale = scale_of(values);
    head["cheapest"] = scale.min;
    head["median"] = scale.median;
    head["brightest"] = scale.high;
    head["dearest"] = scale.max;
    return paint_heat(image.size, values, scale);
  }
  const ValueScale scale = scale_of(depths_of(image));
  head["nearest"] = scale.min;
  head["furthest"] = scale.max;
  switch (options.show) {
    case Show::kDepth:
      return paint_depth(image, scale);
    case Show::kNormals:
      return paint_normals(image);
    case Show::kIds:
      return paint_ids(image);
    case Show::kShaded:
      break;
  }
  return paint_shaded(image, camera);
}

Json triple_json(Vec3d v) { return Json::array({v.x, v.y, v.z}); }

Json head_of(const RenderOptions& options, const Camera& camera, const CastResult& cast, absl::Duration took) {
  const double seconds = absl::ToDoubleSeconds(took);
  const RayImage& image = cast.image;
  Json head = {{"file", options.out},
               {"width", picture_size(options).width},
               {"height", picture_size(options).height},
               {"eye", triple_json(camera.eye)},
               {"direction", triple_json(camera.axes.forward)},
               {"epoch", id_json(options.cast.revision.epoch)},
               {"revision", cast.last_revision},
               {"tick", cast.tick}};
  if (options.live) head["first_revision"] = cast.first_revision;
  head["rays"] = image.size.pixels();
  head["hits"] = image.hits();
  head["seconds"] = Json::parse(absl::StrFormat("%.2f", seconds));
  head["rays_per_s"] = static_cast<uint64_t>(static_cast<double>(image.size.pixels()) / std::max(seconds, 1e-9));
  head["depth_sha256"] = depth_sha256(image);
  head["ids_sha256"] = ids_sha256(image);
  return head;
}

// Returns the line that says what was rendered. `head` is the head of the report.
std::string picture_text(const Json& head) {
  const auto text = [&head](const char* key) { return table_cell(head[key]); };
  return absl::StrCat(text("file"), ": ", text("width"), "x", text("height"), ", ", text("hits"), " of ", text("rays"),
                      " rays hit, ", text("seconds"), " s, revision ", text("revision"));
}

absl::Status render(const RenderOptions& given, Context& context) {
  RenderOptions options = given;
  RETURN_IF_ERROR(check_line(options));
  options.cast.mask = static_cast<uint32_t>(options.mask.value);
  if (options.live) options.cast.revisions = Revisions::kLive;
  if (options.heat != Heat::kNone) options.cast.work = WorkReport::kReported;
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const Aabbd target, find_target(options, *client));
  const ImageSize size = *ray_image_size(options);
  ASSIGN_OR_RETURN(const Camera camera, camera_of(options.camera, target, size));
  ProgressWriter progress = start_progress(context);
  progress.begin({.action = "rendering", .subject = options.out, .unit = "rays", .total = size.pixels()});
  const absl::Time start = absl::Now();
  ASSIGN_OR_RETURN(const CastResult cast,
                   cast_rays(*client, camera, size, options.cast, [&](uint64_t done) { progress.update(done); }));
  const absl::Duration took = absl::Now() - start;
  progress.begin({.action = "writing", .subject = options.out});
  Report report;
  report.head = head_of(options, camera, cast, took);
  const Picture picture = paint(options, cast.image, camera, report.head);
  RETURN_IF_ERROR(write_png(options.out, reduced(picture, rays_a_side(options))));
  progress.hide();
  context.acknowledge(report, picture_text(report.head));
  return absl::OkStatus();
}

void add_what_options(CLI::App& command, RenderOptions& options) {
  command.add_option("--size", options.size, "Pixels; at most 16777216 rays [960x540; 480x270 with --heat]")
      ->type_name("WxH");
  const NamedValues<Samples> samples = {{"1", Samples::kOne}, {"4", Samples::kFour}};
  command.add_option("--samples", options.samples, "Rays for each pixel, averaged: 1, 4 [1]")
      ->type_name("N")
      ->transform(choices(samples));
  const NamedValues<Show> shows = {
      {"shaded", Show::kShaded}, {"depth", Show::kDepth}, {"normals", Show::kNormals}, {"ids", Show::kIds}};
  CLI::Option* show = command.add_option("--show", options.show, "What to paint: shaded, depth, normals, ids [shaded]")
                          ->type_name("WHAT")
                          ->transform(choices(shows));
  const NamedValues<Heat> heats = {
      {"work", Heat::kWork}, {"nodes", Heat::kNodes}, {"cells", Heat::kCells}, {"tests", Heat::kTests}};
  command
      .add_option("--heat", options.heat,
                  "Paint what each ray cost instead: work (all of the following), nodes of trees, cells of the grid, "
                  "tests of triangles and objects")
      ->type_name("COST")
      ->transform(choices(heats))
      ->excludes(show);
}

void add_view_ray_options(CLI::App& command, RenderOptions& options) {
  const NamedValues<v1::Cull> culls = {{"none", v1::CULL_NONE}, {"back", v1::CULL_BACK}, {"front", v1::CULL_FRONT}};
  options.cast.cull = v1::CULL_BACK;
  command
      .add_option(
          "--cull", options.cast.cull,
          "Side of triangles to look through: none, back, front; back opens rooms to a view from outside [back]")
      ->type_name("SIDE")
      ->transform(choices(culls));
  const NamedValues<v1::Source> sources = {
      {"both", v1::SOURCE_BOTH}, {"static", v1::SOURCE_STATIC}, {"dynamic", v1::SOURCE_DYNAMIC}};
  command.add_option("--source", options.cast.source, "What to show: both, static, dynamic [both]")
      ->type_name("SOURCE")
      ->transform(choices(sources));
  command.add_option("--mask", options.mask, "Show only things with one of these layers [all]")
      ->type_name("BITS")
      ->check(fits_32_bits());
  command.add_flag("--live", options.live,
                   "Answer each batch of rays at the latest revision, not all at one: for scenes that change fast");
}

}  // namespace

void add_render_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App& command = *parent.add_subcommand("render", "Take a picture of a scene with the server's own rays");
  command.footer(R"(All rays see one revision, moving objects included. The report names it, the rays and hits, and the
SHA-256 of the depths and of the ids and triangles, which are the same for the same scene on every machine.
Examples:
  locus render arena arena.png
  locus render arena player.png --at 7 --show ids
  locus render arena room.png --eye 0,-20,2 --look-at 0,0,1 --fov 60 --size 1920x1080 --samples 4
  locus render arena plan.png --dir 0,0,-1 --ortho 0 --show depth
  locus render arena cost.png --heat work
  locus -o json render model model.png --up 0,1,0 --cull none)");
  add_scene_argument(command, options->cast.scene);
  command.add_option("OUT", options->out, "The picture, a .png file")->required();
  add_what_options(command, *options);
  add_camera_options(command, options->camera);
  add_view_ray_options(command, *options);
  run_when_chosen(command, options, context, render);
}

}  // namespace locus::cli
