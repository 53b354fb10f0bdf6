#include "server/services/cluster_calls.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <vector>

#include "core/base/limits.h"
#include "core/base/names.h"
#include "core/base/status_macros.h"
#include "core/scene/spec_codec.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"
#include "server/host/epoch.h"
#include "server/observability/log.h"
#include "server/services/cluster/cluster_meshes.h"
#include "server/services/cluster/cluster_scenes.h"
#include "server/services/scene_access.h"
#include "server/services/scene_calls.h"

namespace locus::server {
namespace {

// Longest wait of a move for the engine.
constexpr std::chrono::seconds kMoveWait{10};
// Size in bytes of the meshes in a page, like that of a server without a cluster.
constexpr size_t kMaxPageBytes = 3'900'000;

// Returns what is known of a scene that this server does not have.
v1::Scene describe_row(const Host& host, const CatalogueScene& row) {
  v1::Scene scene;
  scene.set_name(row.name);
  scene.set_epoch(row.epoch);
  *scene.mutable_placement() = host.cluster->placement_of(row);
  const absl::StatusOr<SceneSpec> spec = decode_spec(row.spec);
  if (row.damage.ok() && spec.ok()) {
    *scene.mutable_spec() = spec_to_proto(*spec, {spec->labels, spec->cell_size});
    const bool elsewhere = scene.placement().role() == v1::SCENE_ROLE_ELSEWHERE;
    scene.set_state(elsewhere ? v1::SCENE_STATE_READY : v1::SCENE_STATE_RECOVERING);
    return scene;
  }
  scene.set_state(v1::SCENE_STATE_DAMAGED);
  scene.set_last_build_error(std::string((row.damage.ok() ? spec.status() : row.damage).message()));
  return scene;
}

bool has_labels(const v1::Scene& scene, const google::protobuf::Map<std::string, std::string>& labels) {
  return std::all_of(labels.begin(), labels.end(), [&](const auto& label) {
    const auto found = scene.spec().labels().find(label.first);
    return found != scene.spec().labels().end() && found->second == label.second;
  });
}

}  // namespace

absl::Status create_in_cluster(const Caller& caller, Host& host, const v1::CreateSceneRequest& request,
                               const SceneSpec& spec, v1::CreateSceneResponse& response) {
  ASSIGN_OR_RETURN(
      const ClusterScenes::Created created,
      host.cluster->create(request.name(), spec, new_epoch(), request.spec().static_from(), request.if_absent()));
  if (!created.existed) log(LogLevel::kInfo, "scene created", {{"scene", request.name()}});
  const absl::StatusOr<ScenePtr> scene = host.cluster->wait_for(request.name());
  *response.mutable_scene() = scene.ok() ? describe(host, caller, **scene) : describe_row(host, created.row);
  return absl::OkStatus();
}

absl::Status list_in_cluster(const Caller& caller, Host& host, const v1::ListScenesRequest& request, std::string after,
                             size_t page_size, v1::ListScenesResponse& response) {
  while (true) {
    RETURN_IF_ERROR(caller.stop());
    ASSIGN_OR_RETURN(const std::vector<CatalogueScene> rows, host.cluster->list(after, limits::kMaxPageSize));
    for (const CatalogueScene& row : rows) {
      if (caller.may(Right::kRead, row.name)) {
        const absl::StatusOr<ScenePtr> local = host.registry.find_scene(row.name);
        v1::Scene scene = local.ok() ? describe(host, caller, **local) : describe_row(host, row);
        if (absl::IsDataLoss(local.status())) {
          scene.set_state(v1::SCENE_STATE_DAMAGED);
          scene.set_last_build_error(std::string(local.status().message()));
        }
        if (has_labels(scene, request.labels())) {
          if (static_cast<size_t>(response.scenes_size()) == page_size) {
            response.set_next_page_token(response.scenes(response.scenes_size() - 1).name());
            return absl::OkStatus();
          }
          response.add_scenes()->Swap(&scene);
        }
      }
      after = row.name;
    }
    if (rows.size() < limits::kMaxPageSize) return absl::OkStatus();
  }
}

absl::Status list_cluster_meshes(Host& host, const std::string& after, size_t page_size, size_t max_part_bytes,
                                 v1::ListMeshesResponse& response) {
  ASSIGN_OR_RETURN(const std::vector<StoredMesh> rows, host.cluster_meshes->list(after, page_size + 1));
  size_t bytes = 0;
  for (const StoredMesh& row : rows) {
    v1::Mesh mesh;
    const absl::StatusOr<MeshPtr> known = host.registry.find_mesh(row.name, "mesh");
    if (known.ok() && (*known)->sha256() == row.sha256) {
      mesh = to_proto(Registry::NamedMesh{row.name, *known, host.registry.mesh_uses(known->get())}, 0, max_part_bytes);
    } else {
      mesh.set_name(row.name);
      mesh.set_sha256(row.sha256.data(), row.sha256.size());
    }
    bytes += mesh.ByteSizeLong();
    const size_t listed = static_cast<size_t>(response.meshes_size());
    if (listed == page_size || (listed > 0 && bytes > kMaxPageBytes)) {
      response.set_next_page_token(response.meshes(response.meshes_size() - 1).name());
      return absl::OkStatus();
    }
    response.add_meshes()->Swap(&mesh);
  }
  return absl::OkStatus();
}

absl::Status move_scene(const Caller& caller, Host& host, const v1::MoveSceneRequest& request,
                        v1::MoveSceneResponse& response) {
  caller.set_subject(request.scene());
  ASSIGN_OR_RETURN(const ScenePtr scene, find_scene(host, caller, request.scene(), "scene", LookUp::kMayWait));
  if (host.cluster == nullptr) return not_served("scene");
  const SteadyTime until = std::min(caller.deadline(), SteadyTime::clock::now() + kMoveWait);
  ASSIGN_OR_RETURN(response, host.cluster->move(request.scene(), request.to(), until));
  log(LogLevel::kInfo, "scene moved", {{"scene", request.scene()}, {"to", response.leader()}});
  return absl::OkStatus();
}

}  // namespace locus::server
