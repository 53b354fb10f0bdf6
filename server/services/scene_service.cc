#include "server/services/scene_service.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"
#include "server/observability/log.h"
#include "server/rpc/call.h"
#include "server/services/epochs.h"
#include "server/services/instance_changes.h"
#include "server/services/mesh_download.h"
#include "server/services/mesh_upload.h"
#include "server/services/scene_dump.h"

namespace locus::server {
namespace {

absl::StatusOr<size_t> read_page_size(uint32_t asked) {
  if (asked > limits::kMaxPageSize) return refuse_limit("page_size", "page_size", limits::kMaxPageSize, asked);
  return asked == 0 ? limits::kMaxPageSize : asked;
}

// Checks a page token. A token is the last name of the previous page; `name_status` is the result of checking that
// name.
absl::Status check_page_token(const absl::Status& name_status) {
  if (name_status.ok()) return name_status;
  return refuse_argument(Reason::kMalformed, "page_token", {},
                         "this server did not give that token; pass next_page_token as it came, or none");
}

bool has_labels(const Scene& scene, const google::protobuf::Map<std::string, std::string>& labels) {
  for (const auto& [key, value] : labels) {
    const auto label = scene.spec().labels.find(key);
    if (label == scene.spec().labels.end() || label->second != value) return false;
  }
  return true;
}

// Entry of a page of scenes.
struct Listed {
  std::string name;
  ScenePtr scene;  // null for a damaged scene
  absl::Status damage;
};

// Returns the damaged scenes whose names follow `after`; none if the request filters by labels, because the labels of
// damaged scenes are not known.
std::vector<Listed> damaged_after(const Host& host, const std::string& after, const v1::ListScenesRequest& request) {
  std::vector<Listed> result;
  if (!request.labels().empty()) return result;
  for (const Registry::Damaged& scene : host.registry.damaged_scenes())
    if (scene.name > after) result.push_back({scene.name, nullptr, scene.damage});
  return result;
}

v1::Scene describe(const Host& host, const Listed& listed) {
  if (listed.scene != nullptr) return describe(host, *listed.scene);
  v1::Scene scene;
  scene.set_name(listed.name);
  scene.set_state(v1::SCENE_STATE_DAMAGED);
  scene.set_last_build_error(std::string(listed.damage.message()));
  return scene;
}

absl::Status list_scenes(const Host& host, const v1::ListScenesRequest& request, v1::ListScenesResponse* response) {
  ASSIGN_OR_RETURN(const size_t page_size, read_page_size(request.page_size()));
  RETURN_IF_ERROR(check_labels(request.labels(), "labels"));
  std::string after = request.page_token();
  if (!after.empty()) RETURN_IF_ERROR(check_page_token(check_scene_name(after, "page_token")));
  std::vector<Listed> all = damaged_after(host, after, request);
  while (true) {
    const std::vector<ScenePtr> scenes = host.registry.list_scenes(after, limits::kMaxPageSize);
    for (const ScenePtr& scene : scenes) {
      after = scene->name();
      if (has_labels(*scene, request.labels())) all.push_back({after, scene, absl::OkStatus()});
    }
    if (scenes.size() < limits::kMaxPageSize) break;
  }
  std::sort(all.begin(), all.end(), [](const Listed& a, const Listed& b) { return a.name < b.name; });
  for (size_t i = 0; i < std::min(all.size(), page_size); ++i) *response->add_scenes() = describe(host, all[i]);
  if (all.size() > page_size) response->set_next_page_token(all[page_size - 1].name);
  return absl::OkStatus();
}

absl::Status list_meshes(const Host& host, const v1::ListMeshesRequest& request, v1::ListMeshesResponse* response) {
  ASSIGN_OR_RETURN(const size_t page_size, read_page_size(request.page_size()));
  if (!request.page_token().empty())
    RETURN_IF_ERROR(check_page_token(check_mesh_name(request.page_token(), "page_token")));
  const std::vector<Registry::NamedMesh> meshes = host.registry.list_meshes(request.page_token(), page_size + 1);
  for (size_t i = 0; i < std::min(meshes.size(), page_size); ++i) *response->add_meshes() = to_proto(meshes[i]);
  if (meshes.size() > page_size) response->set_next_page_token(meshes[page_size - 1].name);
  return absl::OkStatus();
}

absl::Status delete_scene(const Caller& caller, Host& host, const v1::DeleteSceneRequest& request) {
  const absl::StatusOr<ScenePtr> scene = find_scene(caller, request.name(), "name");
  absl::Status status = scene.status();
  // A damaged scene can still be deleted.
  if (status.ok() || absl::IsDataLoss(status)) status = host.registry.delete_scene(request.name());
  if (status.code() == absl::StatusCode::kNotFound && request.if_present()) return absl::OkStatus();
  if (!status.ok()) return status;
  if (scene.ok()) host.changes.forget((*scene)->latest()->epoch);
  log(LogLevel::kInfo, "scene deleted", {{"scene", request.name()}});
  return absl::OkStatus();
}

}  // namespace

absl::Status SceneService::create(const Caller& caller, const v1::CreateSceneRequest& request,
                                  v1::CreateSceneResponse* response) {
  RETURN_IF_ERROR(check_scene_name(request.name(), "name"));
  RETURN_IF_ERROR(caller.check_scene(request.name()));
  ASSIGN_OR_RETURN(SceneSpec spec, to_spec(request.spec()));
  if (request.spec().durability() == v1::DURABILITY_LOCAL && host_.log == nullptr) return not_served("spec.durability");
  spec.pinned_bytes = host_.config.pinned_limit;
  const std::string& static_from = request.spec().static_from();
  if (!static_from.empty()) RETURN_IF_ERROR(check_scene_name(static_from, "spec.static_from"));
  MutexLock lock(create_mutex_);
  const size_t scenes = host_.registry.scene_count();
  if (scenes >= host_.config.max_scenes && !host_.registry.find_scene(request.name()).ok())
    return refuse_full("name", "scenes", host_.config.max_scenes, static_cast<double>(scenes + 1), 0);
  ASSIGN_OR_RETURN(const Registry::CreatedScene created,
                   host_.registry.create_scene(request.name(), spec, new_epoch(), static_from, request.if_absent()));
  if (!created.existed) log(LogLevel::kInfo, "scene created", {{"scene", request.name()}});
  *response->mutable_scene() = describe(host_, *created.scene);
  return absl::OkStatus();
}

grpc::Status SceneService::CreateScene(grpc::ServerContext* context, const v1::CreateSceneRequest* request,
                                       v1::CreateSceneResponse* response) {
  return serve(host_, *context, Rpc::kCreateScene,
               [&](const Caller& caller) { return create(caller, *request, response); });
}

grpc::Status SceneService::GetScene(grpc::ServerContext* context, const v1::GetSceneRequest* request,
                                    v1::GetSceneResponse* response) {
  return serve(host_, *context, Rpc::kGetScene, [&](const Caller& caller) {
    const absl::StatusOr<ScenePtr> scene = find_scene(caller, request->name(), "name");
    if (scene.ok()) *response->mutable_scene() = describe(host_, **scene);
    return scene.status();
  });
}

grpc::Status SceneService::ListScenes(grpc::ServerContext* context, const v1::ListScenesRequest* request,
                                      v1::ListScenesResponse* response) {
  return serve(host_, *context, Rpc::kListScenes,
               [&](const Caller&) { return list_scenes(host_, *request, response); });
}

grpc::Status SceneService::DeleteScene(grpc::ServerContext* context, const v1::DeleteSceneRequest* request,
                                       v1::DeleteSceneResponse*) {
  return serve(host_, *context, Rpc::kDeleteScene,
               [&](const Caller& caller) { return delete_scene(caller, host_, *request); });
}

grpc::Status SceneService::UploadMesh(grpc::ServerContext* context, grpc::ServerReader<v1::UploadMeshRequest>* reader,
                                      v1::UploadMeshResponse* response) {
  return serve(host_, *context, Rpc::kUploadMesh,
               [&](const Caller& caller) { return upload_mesh(host_, caller, *reader, response); });
}

grpc::Status SceneService::ListMeshes(grpc::ServerContext* context, const v1::ListMeshesRequest* request,
                                      v1::ListMeshesResponse* response) {
  return serve(host_, *context, Rpc::kListMeshes,
               [&](const Caller&) { return list_meshes(host_, *request, response); });
}

grpc::Status SceneService::DeleteMesh(grpc::ServerContext* context, const v1::DeleteMeshRequest* request,
                                      v1::DeleteMeshResponse*) {
  return serve(host_, *context, Rpc::kDeleteMesh, [&](const Caller&) -> absl::Status {
    RETURN_IF_ERROR(check_mesh_name(request->mesh(), "mesh"));
    RETURN_IF_ERROR(host_.registry.delete_mesh(request->mesh()));
    log(LogLevel::kInfo, "mesh deleted", {{"mesh", request->mesh()}});
    return absl::OkStatus();
  });
}

grpc::Status SceneService::DownloadMesh(grpc::ServerContext* context, const v1::DownloadMeshRequest* request,
                                        grpc::ServerWriter<v1::DownloadMeshResponse>* writer) {
  return serve(host_, *context, Rpc::kDownloadMesh,
               [&](const Caller& caller) { return download_mesh(host_, caller, *request, *writer); });
}

grpc::Status SceneService::ChangeInstances(grpc::ServerContext* context, const v1::ChangeInstancesRequest* request,
                                           v1::ChangeInstancesResponse* response) {
  return serve(host_, *context, Rpc::kChangeInstances,
               [&](const Caller& caller) { return change_instances(host_, caller, *request, response); });
}

grpc::Status SceneService::DumpScene(grpc::ServerContext* context, const v1::DumpSceneRequest* request,
                                     grpc::ServerWriter<v1::DumpSceneResponse>* writer) {
  return serve(host_, *context, Rpc::kDumpScene,
               [&](const Caller& caller) { return dump_scene(caller, *request, *writer); });
}

}  // namespace locus::server
