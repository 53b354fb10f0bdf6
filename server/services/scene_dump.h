// DumpScene: sends all objects and instances of a scene at one revision, in pieces of bounded size. A piece has the
// messages of inserts and placements, so that a client can send it back unchanged. Functions without state; any thread.
#ifndef LOCUS_SERVER_SERVICES_SCENE_DUMP_H_
#define LOCUS_SERVER_SERVICES_SCENE_DUMP_H_

#include <grpcpp/support/sync_stream.h>

#include <functional>

#include "absl/status/status.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "locus/v1/scene_service.pb.h"
#include "server/rpc/call.h"

namespace locus::server {

// Function that writes a piece to the caller; returns false to end the dump.
using TakeDumpPiece = std::function<bool(const v1::DumpSceneResponse&)>;

// Sends objects, then instances, each in ascending order of ids, in one or more pieces. Returns false if `take` ended
// the dump.
bool dump_snapshot(const SceneSnapshot& snapshot, const TakeDumpPiece& take);

absl::Status dump_scene(const Caller& caller, const v1::DumpSceneRequest& request,
                        grpc::ServerWriter<v1::DumpSceneResponse>& writer);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SCENE_DUMP_H_
