#include "server/services/scene_service.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/limits.h"
#include "core/base/names.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"
#include "server/host/epoch.h"
#include "server/observability/log.h"
#include "server/rpc/call.h"
#include "server/services/cluster/cluster_meshes.h"
#include "server/services/cluster/cluster_scenes.h"
#include "server/services/cluster_calls.h"
#include "server/services/creator_quotas.h"
#include "server/services/scene_access.h"
#include "server/services/scene_calls.h"

namespace locus::server {
namespace {

// Maximum size in bytes of the meshes in a page. Leaves room for the page token.
constexpr size_t kMaxPageBytes = 3'900'000;
static_assert(kMaxDescribedPartBytes + limits::kMaxNameLength + 1024 <= kMaxPageBytes);
static_assert(kMaxPageBytes + limits::kMaxNameLength + 16 <= limits::kDefaultReplyBytes);

absl::StatusOr<size_t> read_page_size(uint32_t asked) {
  if (asked > limits::kMaxPageSize) return refuse_limit("page_size", "page_size", limits::kMaxPageSize, asked);
  return asked == 0 ? limits::kMaxPageSize : asked;
}

// Checks a page token. A token is the last name of the previous page; `name_status` is the result of checking that
// name.
absl::Status check_page_token(const absl::Status& name_status) {
  if (name_status.ok()) return name_status;
  return refuse_argument(Reason::kMalformed, "page_token", {},
                         "this is no page token of this server; pass next_page_token unchanged, or none");
}

bool has_labels(const Scene& scene, const google::protobuf::Map<std::string, std::string>& labels) {
  if (labels.empty()) return true;
  const SceneSettings settings = scene.settings();
  for (const auto& [key, value] : labels) {
    const auto label = settings.labels.find(key);
    if (label == settings.labels.end() || label->second != value) return false;
  }
  return true;
}

// Entry of a page of scenes.
struct Listed {
  std::string name;
  ScenePtr scene;  // null for a damaged scene
  absl::Status damage;
};

// Returns the damaged scenes that the caller may read and whose names follow `after`. Returns no scene if the request
// filters by labels, because the labels of damaged scenes are not known.
std::vector<Listed> damaged_after(const Caller& caller, const Host& host, const std::string& after,
                                  const v1::ListScenesRequest& request) {
  std::vector<Listed> result;
  if (!request.labels().empty()) return result;
  for (const Registry::Damaged& scene : host.registry.damaged_scenes())
    if (scene.name > after && caller.may(Right::kRead, scene.name))
      result.push_back({scene.name, nullptr, scene.damage});
  return result;
}

v1::Scene describe(Host& host, const Caller& caller, const Listed& listed) {
  if (listed.scene != nullptr) return describe(host, caller, *listed.scene);
  v1::Scene scene;
  scene.set_name(listed.name);
  scene.set_state(v1::SCENE_STATE_DAMAGED);
  scene.set_last_build_error(std::string(listed.damage.message()));
  return scene;
}

// Upper bound in bytes of the memory of one scene's description in a response, its labels included.
constexpr uint64_t kDescribedSceneBytes = 1024 + limits::kMaxLabels * (2 * limits::kMaxLabelLength + 128);
// Number of copies of a page that exist at the same time: the message and its serialized bytes.
constexpr uint64_t kPageCopies = 2;

absl::Status list_scenes(const Caller& caller, Host& host, const v1::ListScenesRequest& request,
                         v1::ListScenesResponse& response) {
  RETURN_IF_ERROR(check_work(caller));
  ASSIGN_OR_RETURN(const size_t page_size, read_page_size(request.page_size()));
  RETURN_IF_ERROR(check_labels(request.labels(), "labels"));
  std::string after = request.page_token();
  if (!after.empty()) RETURN_IF_ERROR(check_page_token(check_scene_name(after, "page_token")));
  const size_t most = host.cluster != nullptr ? page_size : std::min(page_size, host.registry.scene_count());
  ASSIGN_OR_RETURN(const CallMemory claim, claim_copy(caller, kPageCopies * most * kDescribedSceneBytes));
  if (host.cluster != nullptr) return list_in_cluster(caller, host, request, after, page_size, response);
  std::vector<Listed> all = damaged_after(caller, host, after, request);
  while (true) {
    const std::vector<ScenePtr> scenes = host.registry.list_scenes(after, limits::kMaxPageSize);
    for (const ScenePtr& scene : scenes) {
      after = scene->name();
      if (caller.may(Right::kRead, after) && has_labels(*scene, request.labels()))
        all.push_back({after, scene, absl::OkStatus()});
    }
    if (scenes.size() < limits::kMaxPageSize) break;
  }
  std::sort(all.begin(), all.end(), [](const Listed& a, const Listed& b) { return a.name < b.name; });
  for (size_t i = 0; i < std::min(all.size(), page_size); ++i) {
    RETURN_IF_ERROR(caller.stop());
    *response.add_scenes() = describe(host, caller, all[i]);
  }
  if (all.size() > page_size) response.set_next_page_token(all[page_size - 1].name);
  return absl::OkStatus();
}

absl::Status describe_mesh(const Caller& caller, Host& host, const v1::ListMeshesRequest& request,
                           v1::ListMeshesResponse& response) {
  RETURN_IF_ERROR(check_mesh_name(request.mesh(), "mesh"));
  ASSIGN_OR_RETURN(const MeshPtr mesh, find_mesh(host, request.mesh()));
  ASSIGN_OR_RETURN(const CallMemory claim, claim_copy(caller, kPageCopies * parts_cost(mesh->parts())));
  const Registry::NamedMesh named{mesh->name(), mesh, host.registry.mesh_uses(mesh.get())};
  *response.add_meshes() = to_proto(named, request.first_part(), request.without_parts() ? 0 : kMaxDescribedPartBytes);
  return absl::OkStatus();
}

absl::Status list_meshes(const Caller& caller, Host& host, const v1::ListMeshesRequest& request,
                         v1::ListMeshesResponse& response) {
  if (!request.mesh().empty()) return describe_mesh(caller, host, request, response);
  const size_t max_part_bytes = request.without_parts() ? 0 : kMaxDescribedPartBytes;
  ASSIGN_OR_RETURN(const size_t page_size, read_page_size(request.page_size()));
  if (!request.page_token().empty())
    RETURN_IF_ERROR(check_page_token(check_mesh_name(request.page_token(), "page_token")));
  if (host.cluster != nullptr)
    return list_cluster_meshes(host, request.page_token(), page_size, max_part_bytes, response);
  const std::vector<Registry::NamedMesh> meshes = host.registry.list_meshes(request.page_token(), page_size + 1);
  uint64_t most = 0;
  for (const Registry::NamedMesh& mesh : meshes) most += parts_cost(mesh.mesh->parts());
  ASSIGN_OR_RETURN(const CallMemory claim, claim_copy(caller, kPageCopies * most));
  size_t listed = 0, bytes = 0;
  for (; listed < std::min(meshes.size(), page_size); ++listed) {
    v1::Mesh mesh = to_proto(meshes[listed], 0, max_part_bytes);
    bytes += mesh.ByteSizeLong();
    if (listed > 0 && bytes > kMaxPageBytes) break;
    *response.add_meshes() = std::move(mesh);
  }
  if (listed < meshes.size()) response.set_next_page_token(meshes[listed - 1].name);
  return absl::OkStatus();
}

absl::Status delete_scene(const Caller& caller, Host& host, const v1::DeleteSceneRequest& request) {
  caller.set_subject(request.name());
  const absl::StatusOr<ScenePtr> scene = find_scene(host, caller, request.name(), "name", LookUp::kMayWait);
  absl::Status status = scene.status();
  // A damaged scene can still be deleted.
  if (status.ok() || absl::IsDataLoss(status))
    status =
        host.cluster != nullptr ? host.cluster->remove(request.name()) : host.registry.delete_scene(request.name());
  if (status.code() == absl::StatusCode::kNotFound && request.if_present()) return absl::OkStatus();
  RETURN_IF_ERROR(status);
  if (scene.ok()) {
    host.changes.forget((*scene)->latest()->epoch);
    host.idle_scenes.forget(**scene);
    host.leases.forget(**scene);
  }
  log(LogLevel::kInfo, "scene deleted", {{"scene", request.name()}});
  return absl::OkStatus();
}

// Checks the scene whose instances a new scene copies. A scene that the caller may not read is treated as missing.
absl::Status check_source(const Host& host, const Caller& caller, const std::string& source) {
  RETURN_IF_ERROR(check_scene_name(source, "spec.static_from"));
  if (caller.may(Right::kRead, source)) return absl::OkStatus();
  caller.audit_hidden(source);
  return host.registry.no_source(source);
}

// Adds the scene. If a scene of this name exists, returns that scene if request.if_absent(), else ALREADY_EXISTS.
absl::StatusOr<Registry::CreatedScene> add_scene(Host& host, const v1::CreateSceneRequest& request,
                                                 const SceneSpec& spec) {
  const MutexLock lock(host.create_mutex);
  const size_t scenes = host.registry.scene_count();
  if (scenes >= host.config.max_scenes && !host.registry.find_scene(request.name()).ok())
    return refuse_full("name", "scenes", host.config.max_scenes, static_cast<double>(scenes + 1), 0);
  std::vector<QuotaHold> quotas;  // held until the registry counts the scene
  if (absl::IsNotFound(host.registry.find_scene(request.name()).status())) {
    ASSIGN_OR_RETURN(quotas, hold_scene(host, spec));
  }
  return host.registry.create_scene(request.name(), spec, new_epoch(), request.spec().static_from(),
                                    request.if_absent());
}

// Takes the quotas of a new scene. Counts the scenes of this server, which is where a scene of a cluster is created,
// but not always where it is placed.
absl::StatusOr<std::vector<QuotaHold>> hold_in_cluster(Host& host, const std::string& name, const SceneSpec& spec) {
  const size_t scenes = host.registry.scene_count();
  if (host.registry.find_scene(name).ok()) return std::vector<QuotaHold>();
  if (scenes >= host.config.max_scenes)
    return refuse_full("name", "scenes", host.config.max_scenes, static_cast<double>(scenes + 1), 0);
  return hold_scene(host, spec);
}

// Returns UNIMPLEMENTED if this server does not store scenes as `spec` asks.
absl::Status check_durability(const Host& host, const v1::SceneSpec& spec) {
  const bool local = spec.durability() == v1::DURABILITY_LOCAL;
  const bool replicated = spec.durability() == v1::DURABILITY_REPLICATED;
  const bool served = host.cluster != nullptr ? !local : !replicated && (!local || host.log != nullptr);
  return served ? absl::OkStatus() : not_served("spec.durability");
}

absl::Status create_scene(const Caller& caller, Host& host, const v1::CreateSceneRequest& request,
                          v1::CreateSceneResponse& response) {
  RETURN_IF_ERROR(check_scene_name(request.name(), "name"));
  RETURN_IF_ERROR(caller.check_scene(request.name()));
  caller.set_subject(request.name());
  if (!caller.may(Right::kAdmin, request.name())) return caller.lacks_right(Right::kAdmin, request.name());
  ASSIGN_OR_RETURN(SceneSpec spec, to_spec(request.spec()));
  RETURN_IF_ERROR(check_durability(host, request.spec()));
  if (request.spec().followers() > 0) return not_served("spec.followers");
  // Any member could delete a mesh, but only members with scenes that use it know since when it is not used.
  if (host.cluster != nullptr && spec.mesh_grace_s > 0) return not_served("spec.mesh_grace_s");
  if (host.cluster != nullptr && spec.durability == Durability::kLocal) spec.durability = Durability::kReplicated;
  spec.pinned_bytes = host.pinned_limit();
  spec.creator = creator_name(caller);
  const std::string& static_from = request.spec().static_from();
  UsedScene source;
  if (!static_from.empty()) {
    RETURN_IF_ERROR(check_source(host, caller, static_from));
    if (const absl::StatusOr<ScenePtr> found = host.registry.find_scene(static_from); found.ok())
      source = UsedScene(*found);
  }
  if (host.cluster != nullptr) {
    ASSIGN_OR_RETURN(const std::vector<QuotaHold> quotas, hold_in_cluster(host, request.name(), spec));
    return create_in_cluster(caller, host, request, spec, response);
  }
  ASSIGN_OR_RETURN(const Registry::CreatedScene created, add_scene(host, request, spec));
  const UsedScene use(created.scene);
  if (!created.existed) {
    host.idle_scenes.watch(created.scene);
    host.mesh_collector.instances_changed(*created.scene);
    log(LogLevel::kInfo, "scene created", {{"scene", request.name()}});
  }
  *response.mutable_scene() = describe(host, caller, *created.scene);
  return absl::OkStatus();
}

v1::SceneDescription describe_structures(Host& host, const Scene& scene) {
  const SnapshotPtr snapshot = scene.latest();
  const SceneStructures sizes = structures_of(*snapshot);
  const double fixed_cell_size = scene.settings().cell_size;
  v1::SceneDescription description;
  v1::Structure& statics = *description.mutable_statics();
  statics.set_kind(v1::STRUCTURE_KIND_BVH);
  statics.set_values(snapshot->statics->size());
  statics.set_levels(sizes.static_levels);
  statics.set_nodes(sizes.static_nodes);
  statics.set_bytes(sizes.static_bytes);
  v1::Structure& objects = *description.mutable_objects();
  objects.set_kind(v1::STRUCTURE_KIND_HASH_GRID);
  objects.set_values(snapshot->objects.size());
  objects.set_levels(sizes.object_levels);
  objects.set_bricks(sizes.object_bricks);
  objects.set_cell_size(fixed_cell_size != 0 ? fixed_cell_size : sizes.cell_size);
  objects.set_bytes(sizes.object_bytes);
  for (const KindCost& cost : host.costs.learned(snapshot->epoch, tested_by_list(*snapshot))) {
    v1::LearnedCost& learned = *description.add_costs();
    learned.set_kind(std::string(cost_kind_name(cost.kind)));
    learned.set_source(to_proto(cost.source));
    learned.set_nanoseconds(cost.nanoseconds);
    learned.set_work(cost.work);
    learned.set_by_list(cost.by_list);
  }
  return description;
}

absl::Status get_scene(const Caller& caller, Host& host, const v1::GetSceneRequest& request,
                       v1::GetSceneResponse& response) {
  ASSIGN_OR_RETURN(const ScenePtr scene, find_scene(host, caller, request.name(), "name", LookUp::kMayWait));
  RETURN_IF_ERROR(check_work(caller));
  *response.mutable_scene() = describe(host, caller, *scene);
  *response.mutable_description() = describe_structures(host, *scene);
  return absl::OkStatus();
}

absl::Status update_scene(const Caller& caller, Host& host, const v1::UpdateSceneRequest& request,
                          v1::UpdateSceneResponse& response) {
  caller.set_subject(request.name());
  ASSIGN_OR_RETURN(const UsedScene scene, use_scene(host, caller, request.name(), "name", LookUp::kMayWait));
  RETURN_IF_ERROR(check_work(caller));
  ASSIGN_OR_RETURN(const SettingsChange change, to_settings(request));
  ASSIGN_OR_RETURN(const SceneSettings settings, scene->change_settings(change));
  if (host.cluster != nullptr && scene->log_key() == 0) RETURN_IF_ERROR(host.cluster->store_settings(*scene));
  response.set_cell_size(settings.cell_size);
  response.mutable_labels()->insert(settings.labels.begin(), settings.labels.end());
  log(LogLevel::kInfo, "scene updated", {{"scene", request.name()}, {"fields", absl::StrJoin(request.fields(), ",")}});
  return absl::OkStatus();
}

absl::Status delete_mesh(const Caller& caller, Host& host, const v1::DeleteMeshRequest& request) {
  RETURN_IF_ERROR(check_mesh_name(request.mesh(), "mesh"));
  caller.set_subject(request.mesh());
  // In a cluster, this server need not have read the mesh, or has read another one of the name.
  if (host.cluster_meshes != nullptr) RETURN_IF_ERROR(host.cluster_meshes->forget_stale(request.mesh()));
  absl::Status deleted = host.registry.delete_mesh(request.mesh());
  if (host.cluster != nullptr && absl::IsNotFound(deleted)) {
    const absl::Status in_engine = host.log->delete_mesh(request.mesh());
    if (!absl::IsNotFound(in_engine)) deleted = in_engine;
  }
  RETURN_IF_ERROR(deleted);
  log(LogLevel::kInfo, "mesh deleted", {{"mesh", request.mesh()}});
  return absl::OkStatus();
}

using Body = std::function<absl::Status(const Caller&, MessageStream&)>;

BlockingMethod method(const char* name, Rpc rpc, Body body) {
  BlockingMethod made;
  made.path = absl::StrCat("/locus.v1.SceneService/", name);
  made.rpc = rpc;
  made.body = std::move(body);
  return made;
}

BlockingMethod change(const char* name, Rpc rpc, Body body) {
  BlockingMethod made = method(name, rpc, std::move(body));
  made.is_change = true;
  return made;
}

Body create_body(Host& host) {
  return unary_body<v1::CreateSceneRequest, v1::CreateSceneResponse>(
      [&host](const Caller& caller, const auto& request, auto& response) {
        return create_scene(caller, host, request, response);
      });
}

Body get_body(Host& host) {
  return unary_body<v1::GetSceneRequest, v1::GetSceneResponse>(
      [&host](const Caller& caller, const auto& request, auto& response) {
        return get_scene(caller, host, request, response);
      });
}

Body list_body(Host& host) {
  return unary_body<v1::ListScenesRequest, v1::ListScenesResponse>(
      [&host](const Caller& caller, const auto& request, auto& response) {
        return list_scenes(caller, host, request, response);
      });
}

Body delete_body(Host& host) {
  return unary_body<v1::DeleteSceneRequest, v1::DeleteSceneResponse>(
      [&host](const Caller& caller, const auto& request, auto&) { return delete_scene(caller, host, request); });
}

Body update_body(Host& host) {
  return unary_body<v1::UpdateSceneRequest, v1::UpdateSceneResponse>(
      [&host](const Caller& caller, const auto& request, auto& response) {
        return update_scene(caller, host, request, response);
      });
}

Body list_meshes_body(Host& host) {
  return unary_body<v1::ListMeshesRequest, v1::ListMeshesResponse>(
      [&host](const Caller& caller, const auto& request, auto& response) {
        return list_meshes(caller, host, request, response);
      });
}

Body delete_mesh_body(Host& host) {
  return unary_body<v1::DeleteMeshRequest, v1::DeleteMeshResponse>(
      [&host](const Caller& caller, const auto& request, auto&) { return delete_mesh(caller, host, request); });
}

Body download_body(Host& host) {
  return streaming_body<v1::DownloadMeshRequest>(
      [&host](const Caller& caller, const auto& request, MessageStream& stream) {
        return download_mesh(host, caller, request, stream);
      });
}

Body change_body(Host& host) {
  return streaming_body<v1::ChangeInstancesRequest>(
      [&host](const Caller& caller, const auto& request, MessageStream& stream) {
        return change_instances(host, caller, request, stream);
      });
}

Body dump_body(Host& host) {
  return streaming_body<v1::DumpSceneRequest>(
      [&host](const Caller& caller, const auto& request, MessageStream& stream) {
        return dump_scene(host, caller, request, stream);
      });
}

}  // namespace

absl::Status check_work(const Caller& caller) { return caller.take_quota(QuotaKind::kWork, 0); }

v1::Scene describe(Host& host, const Caller& caller, const Scene& scene) {
  std::optional<SceneSummary> summary = scene.known_summary();
  if (!summary) {
    const Turns::Turn turn(host.scene_visits);
    summary = scene.known_summary();  // another call may have computed it meanwhile
    if (!summary) {
      summary = scene.summary();
      caller.charge_quota(QuotaKind::kWork, static_cast<double>(summary->work));
    }
  }
  v1::Scene out = to_proto(scene, *summary);
  // The queue's count includes the change that the scene is building now.
  const uint32_t pending = std::max(out.pending_changes(), host.changes.pending(out.epoch()));
  out.set_pending_changes(pending);
  out.set_state(pending > 0 ? v1::SCENE_STATE_BUILDING : v1::SCENE_STATE_READY);
  if (host.cluster != nullptr) *out.mutable_placement() = host.cluster->placement_of(scene);
  return out;
}

std::vector<BlockingMethod> scene_methods(Host& host) {
  return {
      change("CreateScene", Rpc::kCreateScene, create_body(host)),
      method("GetScene", Rpc::kGetScene, get_body(host)),
      method("ListScenes", Rpc::kListScenes, list_body(host)),
      change("DeleteScene", Rpc::kDeleteScene, delete_body(host)),
      change("UpdateScene", Rpc::kUpdateScene, update_body(host)),
      change("UploadMesh", Rpc::kUploadMesh,
             [&host](const Caller& caller, MessageStream& stream) { return upload_mesh(host, caller, stream); }),
      method("ListMeshes", Rpc::kListMeshes, list_meshes_body(host)),
      change("DeleteMesh", Rpc::kDeleteMesh, delete_mesh_body(host)),
      method("DownloadMesh", Rpc::kDownloadMesh, download_body(host)),
      change("ChangeInstances", Rpc::kChangeInstances, change_body(host)),
      method("DumpScene", Rpc::kDumpScene, dump_body(host)),
  };
}

}  // namespace locus::server
