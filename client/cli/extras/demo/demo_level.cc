#include "client/cli/extras/demo/demo_level.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

Vec3f vertex(const ImportedMesh& mesh, uint32_t index) {
  const float* p = &mesh.vertices[size_t{3} * index];
  return {p[0], p[1], p[2]};
}

std::string mesh_name(const std::string& scene, size_t i) { return absl::StrCat(scene, "-level-", i); }

absl::Status remove_level(const client::Client& client, const std::string& scene, size_t meshes) {
  v1::DeleteSceneRequest request;
  request.set_name(scene);
  request.set_if_present(true);
  RETURN_IF_ERROR(client.delete_scene(request));
  for (size_t i = 0; i < meshes; ++i)
    if (absl::Status status = client.delete_mesh(mesh_name(scene, i)); !status.ok() && !absl::IsNotFound(status))
      return status;
  return absl::OkStatus();
}

}  // namespace

DemoLevel place_level(const ImportedLevel& level) {
  DemoLevel placed;
  const Vec3d translation{level.recentre[0], level.recentre[1], level.recentre[2]};
  for (size_t i = 0; i < level.meshes.size(); ++i) {
    const ImportedMesh& mesh = level.meshes[i];
    CheckedInstance instance{i + 1, make_transform(translation, {}, 1), {}, {}};
    for (size_t corner = 0; corner + 2 < mesh.indices.size(); corner += 3) {
      const auto number = static_cast<uint32_t>(corner / 3);
      const Triangle triangle{vertex(mesh, mesh.indices[corner]), vertex(mesh, mesh.indices[corner + 1]),
                              vertex(mesh, mesh.indices[corner + 2]), number};
      instance.mesh_bounds = merge(instance.mesh_bounds, bounds_of(triangle));
      instance.triangles.push_back(triangle);
    }
    placed.triangles += instance.triangles.size();
    placed.bounds = merge(placed.bounds, bounds_to_world(instance.transform, instance.mesh_bounds));
    placed.instances.push_back(std::move(instance));
  }
  return placed;
}

absl::Status create_level(const client::Client& client, const std::string& scene, const ImportedLevel& level,
                          ProgressWriter& progress) {
  RETURN_IF_ERROR(remove_level(client, scene, level.meshes.size()));
  v1::CreateSceneRequest create;
  create.set_name(scene);
  RETURN_IF_ERROR(client.create_scene(create).status());
  v1::ChangeInstancesRequest change;
  change.set_scene(scene);
  for (size_t i = 0; i < level.meshes.size(); ++i) {
    const ImportedMesh& mesh = level.meshes[i];
    const client::MeshColumns columns{mesh_name(scene, i), mesh.vertices, mesh.indices};
    progress.begin({.action = "uploading", .subject = mesh.name, .unit = kProgressBytes});
    const auto on_sent = [&](uint64_t sent, uint64_t total) {
      progress.update(sent, total);
      if (sent == total) progress.begin({.action = "building", .subject = absl::StrCat("the tree of ", mesh.name)});
    };
    RETURN_IF_ERROR(client.upload_mesh(columns, on_sent).status());
    v1::Placement& placement = *change.add_place();
    placement.set_mesh(columns.name);
    placement.add_ids(i + 1);
    for (const double x : level.recentre) placement.add_translations(x);
  }
  progress.begin({.action = "placing", .subject = absl::StrCat("it in ", scene)});
  return client.change_instances(change).status();
}

}  // namespace locus::cli
