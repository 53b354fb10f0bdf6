// DumpScene: everything in a scene at one revision, in pieces of bounded size that can be sent back as they are.
#ifndef LOCUS_SERVER_SERVICES_SCENE_DUMP_H_
#define LOCUS_SERVER_SERVICES_SCENE_DUMP_H_

#include <grpcpp/support/sync_stream.h>

#include <functional>

#include "absl/status/status.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "locus/v1/scene_service.pb.h"
#include "server/rpc/call.h"

namespace locus::server {

// Takes a piece; false ends the dump.
using TakePiece = std::function<bool(const v1::DumpSceneResponse&)>;

// Objects, then instances, each ascending by id. At least one piece. False when `take` ended it.
bool dump_snapshot(const SceneSnapshot& snapshot, const TakePiece& take);

absl::Status dump_scene(const Caller& caller, const v1::DumpSceneRequest& request,
                        grpc::ServerWriter<v1::DumpSceneResponse>& writer);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SCENE_DUMP_H_
