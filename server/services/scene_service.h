// SceneService over a host: scenes, meshes, instances, dumps. Each rpc checks its request, calls the core and converts
// the result; the longer ones are in files of their own. Threads: gRPC's synchronous threads, several calls at once.
#ifndef LOCUS_SERVER_SERVICES_SCENE_SERVICE_H_
#define LOCUS_SERVER_SERVICES_SCENE_SERVICE_H_

#include "core/base/mutex.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "server/host/host.h"
#include "server/rpc/call.h"

namespace locus::server {

class SceneService final : public v1::SceneService::Service {
 public:
  explicit SceneService(Host& host) : host_(host) {}

  grpc::Status CreateScene(grpc::ServerContext* context, const v1::CreateSceneRequest* request,
                           v1::CreateSceneResponse* response) override;
  grpc::Status GetScene(grpc::ServerContext* context, const v1::GetSceneRequest* request,
                        v1::GetSceneResponse* response) override;
  grpc::Status ListScenes(grpc::ServerContext* context, const v1::ListScenesRequest* request,
                          v1::ListScenesResponse* response) override;
  grpc::Status DeleteScene(grpc::ServerContext* context, const v1::DeleteSceneRequest* request,
                           v1::DeleteSceneResponse* response) override;
  grpc::Status UploadMesh(grpc::ServerContext* context, grpc::ServerReader<v1::UploadMeshRequest>* reader,
                          v1::UploadMeshResponse* response) override;
  grpc::Status ListMeshes(grpc::ServerContext* context, const v1::ListMeshesRequest* request,
                          v1::ListMeshesResponse* response) override;
  grpc::Status DeleteMesh(grpc::ServerContext* context, const v1::DeleteMeshRequest* request,
                          v1::DeleteMeshResponse* response) override;
  grpc::Status DownloadMesh(grpc::ServerContext* context, const v1::DownloadMeshRequest* request,
                            grpc::ServerWriter<v1::DownloadMeshResponse>* writer) override;
  grpc::Status ChangeInstances(grpc::ServerContext* context, const v1::ChangeInstancesRequest* request,
                               v1::ChangeInstancesResponse* response) override;
  grpc::Status DumpScene(grpc::ServerContext* context, const v1::DumpSceneRequest* request,
                         grpc::ServerWriter<v1::DumpSceneResponse>* writer) override;

 private:
  absl::Status create(const Caller& caller, const v1::CreateSceneRequest& request, v1::CreateSceneResponse* response)
      LOCUS_EXCLUDES(create_mutex_);

  Host& host_;
  Mutex create_mutex_;  // makes counting the scenes and adding one a single step
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SCENE_SERVICE_H_
