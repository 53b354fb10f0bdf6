// The calls that only a server in a cluster serves in another way: scenes are created on and listed from the engine,
// and moved between members. Only scene_service.cc and server_service.cc call these functions. No state; any thread.
// All wait for the engine.
#ifndef LOCUS_SERVER_SERVICES_CLUSTER_CALLS_H_
#define LOCUS_SERVER_SERVICES_CLUSTER_CALLS_H_

#include <string>

#include "absl/status/status.h"
#include "locus/v1/cluster.pb.h"
#include "locus/v1/scene_service.pb.h"
#include "server/host/host.h"
#include "server/rpc/call.h"

namespace locus::server {

// Creates a scene in the cluster, and waits for about a second until its leader serves it if that is this server.
absl::Status create_in_cluster(const Caller& caller, Host& host, const v1::CreateSceneRequest& request,
                               const SceneSpec& spec, v1::CreateSceneResponse& response);

// Returns a page of the cluster's scenes after the name `after`. Scenes that this server has are described in full.
absl::Status list_in_cluster(const Caller& caller, Host& host, const v1::ListScenesRequest& request, std::string after,
                             size_t page_size, v1::ListScenesResponse& response);

// Returns a page of the cluster's meshes after the name `after`. Meshes that this server has not read yet have only
// their name and hash. `max_part_bytes` limits the parts of each mesh.
absl::Status list_cluster_meshes(Host& host, const std::string& after, size_t page_size, size_t max_part_bytes,
                                 v1::ListMeshesResponse& response);

// Serves one MoveScene call.
absl::Status move_scene(const Caller& caller, Host& host, const v1::MoveSceneRequest& request,
                        v1::MoveSceneResponse& response);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_CLUSTER_CALLS_H_
