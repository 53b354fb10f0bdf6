// Quotas on what callers create and what stays: scenes, objects, bytes of meshes and of histories. Scenes and meshes
// count against the caller who created them, objects and histories against the creator of their scene, also where
// another caller sends the updates. Without access control nothing has a creator, and nothing is counted.
//
// Each function takes the amount from the creator's quota for as long as the result lives: keep it until what is
// created is registered, because from then on the registry counts it. Errors are RESOURCE_EXHAUSTED and name the quota,
// its value, the use and what to do. No state; any thread.
#ifndef LOCUS_SERVER_SERVICES_CREATOR_QUOTAS_H_
#define LOCUS_SERVER_SERVICES_CREATOR_QUOTAS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/scene/scene.h"
#include "core/scene/updates/update_batch.h"
#include "server/host/host.h"
#include "server/rpc/call.h"

namespace locus::server {

// Returns whom a scene or mesh that the caller creates is counted to; empty without access control.
std::string creator_name(const Caller& caller);

// Takes a scene with the history that `spec` asks for.
absl::StatusOr<std::vector<QuotaHold>> hold_scene(Host& host, const SceneSpec& spec);
// Takes the bytes of a mesh.
absl::StatusOr<QuotaHold> hold_mesh_bytes(Host& host, const std::string& creator, uint64_t bytes);
// Takes the objects that the batch adds to the scene. Ids that the scene has already, and objects that the batch clears
// or removes by their ids, are not counted; objects that it removes by their groups are.
absl::StatusOr<QuotaHold> hold_objects(Host& host, const Scene& scene, const UpdateBatch& batch);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_CREATOR_QUOTAS_H_
