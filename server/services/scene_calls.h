// The longer calls of SceneService, each in a file of its own: instance_changes.cc, mesh_upload.cc, mesh_download.cc
// and scene_dump.cc. Only scene_service.cc calls these functions. They have no state; any thread.
#ifndef LOCUS_SERVER_SERVICES_SCENE_CALLS_H_
#define LOCUS_SERVER_SERVICES_SCENE_CALLS_H_

#include "absl/status/status.h"
#include "locus/v1/scene_service.pb.h"
#include "server/host/host.h"
#include "server/rpc/call.h"
#include "server/rpc/message_stream.h"

namespace locus::server {

// Serves one ChangeInstances call. The changes of a scene run in the background, one after another in the order of
// their numbers. Blocks until the change is published; if request.no_wait is true, returns at once with the change's
// number. Claims memory for the change, its check and its response before it copies anything.
absl::Status change_instances(Host& host, const Caller& caller, const v1::ChangeInstancesRequest& request,
                              MessageStream& stream);

// Returns OK unless the caller has used up its quota of work. describe() and dump_scene() charge this quota.
absl::Status check_work(const Caller& caller);

// Returns the description of a scene, with the number of its pending changes. If the scene has changed since its last
// description, waits for a turn of Host::scene_visits, computes the bounds and charges the caller for the work.
v1::Scene describe(Host& host, const Caller& caller, const Scene& scene);

// Serves one UploadMesh call: collects a mesh from the pieces of a stream, checks it against the announced counts and
// hash, builds its tree and registers it. Blocks while it waits for the caller's messages and while the tree is built.
absl::Status upload_mesh(Host& host, const Caller& caller, MessageStream& stream);

// Serves one DownloadMesh call: sends a mesh as it is stored, in pieces of bounded size, from which an equal mesh can
// be uploaded. Keeps the mesh alive until its last piece is sent, even if it is deleted meanwhile.
absl::Status download_mesh(Host& host, const Caller& caller, const v1::DownloadMeshRequest& request,
                           MessageStream& stream);

// Serves one DumpScene call: sends all objects and instances of a scene at one revision, in pieces of bounded size. A
// piece consists of messages Insert and Placement, so that a client can send them back unchanged in update batches and
// in ChangeInstances calls.
absl::Status dump_scene(Host& host, const Caller& caller, const v1::DumpSceneRequest& request, MessageStream& stream);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SCENE_CALLS_H_
