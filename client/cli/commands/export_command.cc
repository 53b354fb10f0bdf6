#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/commands/scene_up.h"
#include "client/cli/commands/view_options.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/levels/export/scene_export.h"
#include "client/cli/levels/mesh_fetch.h"
#include "client/cli/progress.h"
#include "client/lib/client.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct ExportOptions {
  std::string scene;
  std::string out;
  std::optional<UpAxis> up;  // none = that of the scene
  ViewOptions view;
};

absl::Status check(const ExportOptions& options) {
  if (!absl::EndsWith(absl::AsciiStrToLower(options.out), ".glb"))
    return usage_error(absl::StrCat("cannot tell what to write to ", options.out, ": give a path that ends in .glb"));
  return check(options.view);
}

// Returns the translation that recentres the scene, computed from the scene's current bounds. The dump is read later
// and may have another revision, so the exported scene may be centred only approximately.
std::array<double, 3> find_recentre(const v1::Scene& scene) {
  if (!scene.has_min() || !scene.has_max()) return std::array<double, 3>{};
  return recentre_of({scene.min().x(), scene.min().y(), scene.min().z()},
                     {scene.max().x(), scene.max().y(), scene.max().z()});
}

// Reads the scene and adds to `file` the objects and instances that the options select. Returns the head of the report:
// file, scene, epoch and revision.
absl::StatusOr<Json> read_scene(const ExportOptions& options, SceneExport& file, client::Client& client,
                                Context& context, ProgressWriter& progress) {
  Json head = {{"file", options.out}, {"scene", options.scene}};
  const auto take = [&](const v1::DumpSceneResponse& message) {
    head["epoch"] = id_json(message.epoch());
    head["revision"] = message.revision();
    absl::Status taken = for_each_thing(message, [&](const SceneThing& thing) {
      return is_among(things_of(options.view), thing.kind) ? file.add(thing) : absl::OkStatus();
    });
    progress.update(file.things());
    return taken;
  };
  progress.begin({.action = "reading", .subject = options.scene, .unit = "things"});
  RETURN_IF_ERROR(client.dump(dump_request(options.scene, options.view, context), take));
  if (file.things() == 0)
    return absl::FailedPreconditionError(absl::StrCat("scene ", options.scene, " has nothing to export"));
  return head;
}

absl::Status export_scene(const ExportOptions& options, Context& context) {
  RETURN_IF_ERROR(check(options));
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::Scene scene, client->get_scene(options.scene));
  const std::array<double, 3> recentre = find_recentre(scene);
  SceneExport file(options.scene, options.up.value_or(up_of(scene)), recentre);
  ProgressWriter progress = start_progress(context);
  ASSIGN_OR_RETURN(Json head, read_scene(options, file, *client, context, progress));
  uint64_t triangles = 0;
  for (const std::string& name : file.meshes()) {
    ASSIGN_OR_RETURN(const ImportedMesh mesh, fetch_mesh(name, context, progress));
    triangles += mesh.indices.size() / 3;
    RETURN_IF_ERROR(file.set_mesh(name, mesh));
  }
  progress.begin({.action = "writing", .subject = options.out});
  ASSIGN_OR_RETURN(const uint64_t bytes, file.writer().write(options.out));
  progress.hide();
  if (recentre != std::array<double, 3>{}) {
    context.err() << "note: the file's coordinates are 32-bit floats: everything was moved by " << -recentre[0] << ","
                  << -recentre[1] << "," << -recentre[2] << " to the origin\n";
    head["recentre"] = doubles_json(recentre);
  }
  Report report;
  report.head = std::move(head);
  report.head["things"] = file.things();
  report.head["meshes"] = file.meshes().size();
  report.head["triangles"] = triangles;
  report.head["bytes"] = bytes;
  context.acknowledge(
      report, absl::StrCat(options.out, ": ", file.things(), " things, ", file.meshes().size(), " meshes, ", triangles,
                           " triangles, ", bytes, " bytes, revision ", table_cell(report.head["revision"])));
  return absl::OkStatus();
}

}  // namespace

void add_export_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App& command = *parent.add_subcommand(
      "export", "Write a scene's level and objects to a GLB file, for Blender and other editors");
  command.footer(R"(Examples:
  locus export arena arena.glb
  locus export arena arena.glb --up y
  locus export arena level.glb --instances)");
  add_scene_argument(command, options->scene);
  command.add_option("OUT", options->out, "The file, ending in .glb")->required();
  add_up_option(
      command, options->up,
      "Axis that points up in the scene: y (as in the file), z (rotated to y) [the scene's label up, else z]");
  add_view_options(command, options->view);
  run_when_chosen(command, options, context, export_scene);
}

}  // namespace locus::cli
