#include "client/cli/commands/mesh_placement.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/lib/client.h"
#include "client/lib/status.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

std::string mesh_name(const PlacementOptions& options, const ImportedLevel& level, const ImportedMesh& mesh) {
  if (options.mesh.empty()) return mesh.name;
  return level.meshes.size() == 1 ? options.mesh : absl::StrCat(options.mesh, "-", mesh.name);
}

// Uploads the mesh. After the last byte, the server builds the mesh's tree, which takes longest. `position` is added to
// the mesh's name in the progress.
absl::StatusOr<v1::UploadMeshResponse> upload(const std::string& name, const ImportedMesh& mesh,
                                              const std::string& position, client::Client& client,
                                              ProgressWriter& progress) {
  std::vector<v1::MeshPart> parts;
  for (const MeshPart& part : mesh.parts) {
    v1::MeshPart& sent = parts.emplace_back();
    sent.set_name(part.name);
    sent.set_first_triangle(part.first_triangle);
  }
  const std::string subject = absl::StrCat(name, position);
  progress.begin({.action = "uploading", .subject = subject, .unit = kProgressBytes});
  const auto on_sent = [&](uint64_t sent, uint64_t total) {
    progress.update(sent, total);
    if (sent == total) progress.begin({.action = "building", .subject = absl::StrCat("the tree of ", subject)});
  };
  return client.upload_mesh({.name = name, .vertices = mesh.vertices, .indices = mesh.indices, .parts = parts},
                            on_sent);
}

// Creates the scene if that is requested and there is none. Returns the scene.
absl::StatusOr<v1::Scene> find_scene(const PlacementOptions& options, UpAxis up, client::Client& client) {
  // A missing scene is refused before the meshes are uploaded, which can take minutes.
  if (!options.create) return client.get_scene(options.scene);
  v1::CreateSceneRequest request;
  request.set_name(options.scene);
  request.set_if_absent(true);
  (*request.mutable_spec()->mutable_labels())[kUpLabel] = up_name(up);
  return client.create_scene(request);
}

// Deletes meshes that could not be placed. The server keeps a mesh that another client has placed meanwhile; one that
// another client is about to place is deleted too, and that client then gets an error and can upload it again.
void delete_meshes(const std::vector<std::string>& names, const client::Client& client) {
  // The caller reports why the meshes were not placed. A mesh that cannot be deleted does no harm.
  for (const std::string& name : names) client.delete_mesh(name).IgnoreError();
}

void add_placement(const PlacementOptions& options, const ImportedLevel& level, const std::string& mesh,
                   v1::ChangeInstancesRequest& change) {
  const uint64_t position = static_cast<uint64_t>(change.place_size());
  v1::Placement& placement = *change.add_place();
  placement.set_mesh(mesh);
  if (options.id.value != 0) placement.add_ids(options.id.value + position);
  placement.add_translations(level.recentre[0] + options.at.x);
  placement.add_translations(level.recentre[1] + options.at.y);
  placement.add_translations(level.recentre[2] + options.at.z);
  for (const uint32_t layers : values32_of(options.layers)) placement.add_layers(layers);
  for (const Number64& group : options.groups) placement.add_groups(group.value);
}

}  // namespace

void add_placement_options(CLI::App& command, PlacementOptions& options) {
  command.add_flag("--create", options.create, "Create the scene if there is none");
  command.add_option("--mesh", options.mesh, "The mesh's name on the server [the level's]")->type_name("NAME");
  add_triple(command, "--at", options.at, "Where its origin goes [0,0,0]");
  command.add_option("--id", options.id, "The instance's id [chosen by the server]")->type_name("ID");
  command.add_option("--layers", options.layers, "Layer bits, matched with the masks of queries [1]")
      ->type_name("BITS")
      ->expected(1)
      ->check(fits_32_bits());
  command.add_option("--group", options.groups, "Its group [0: none]")->type_name("GROUP")->expected(1);
}

absl::Status upload_and_place(const PlacementOptions& options, const ImportedLevel& level, Context& context,
                              ProgressWriter& progress) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  const UpAxis up = options.up.value_or(up_of_format(level.source_format));
  ASSIGN_OR_RETURN(const v1::Scene scene, find_scene(options, up, *client));
  if (up_of(scene) != up && !context.options().quiet) {
    progress.hide();
    context.err() << "note: " << up_name(up) << " is up in this level, and " << up_name(up_of(scene)) << " in scene "
                  << options.scene << "; its coordinates are kept\n";
  }
  std::vector<std::string> new_meshes;
  Report report;
  report.rows_name = "meshes";
  v1::ChangeInstancesRequest change;
  change.set_scene(options.scene);
  for (const ImportedMesh& mesh : level.meshes) {
    const std::string name = mesh_name(options, level, mesh);
    const std::string position =
        level.meshes.size() == 1 ? "" : absl::StrCat(" (", report.rows.size() + 1, " of ", level.meshes.size(), ")");
    ASSIGN_OR_RETURN(const v1::UploadMeshResponse uploaded, upload(name, mesh, position, *client, progress));
    if (!uploaded.already_known()) new_meshes.push_back(name);
    add_placement(options, level, name, change);
    report.rows.push_back({{"mesh", name},
                           {"triangles", uploaded.mesh().triangles()},
                           {"zero_area_triangles", uploaded.mesh().zero_area_triangles()},
                           {"already_known", uploaded.already_known()}});
  }
  progress.begin({.action = "placing", .subject = absl::StrCat("it in ", options.scene)});
  const absl::StatusOr<v1::ChangeInstancesResponse> placed = client->change_instances(change);
  if (!placed.ok()) {
    if (client::refused_by_server(placed.status())) delete_meshes(new_meshes, *client);
    return placed.status();
  }
  progress.hide();
  context.remember_own(options.scene, {placed->epoch(), placed->revision()});
  for (size_t i = 0; i < report.rows.size() && static_cast<int>(i) < placed->ids_size(); ++i) {
    report.rows[i]["id"] = id_json(placed->ids(static_cast<int>(i)));
  }
  report.head = {{"scene", options.scene}, {"revision", placed->revision()}};
  if (!level.source_format.empty()) report.head["format"] = level.source_format;
  context.write(report);
  return absl::OkStatus();
}

}  // namespace locus::cli
