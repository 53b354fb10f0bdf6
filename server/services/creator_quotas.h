// Quotas on lasting data that callers create: scenes, objects, and the bytes of meshes and of histories. Scenes and
// meshes count against the caller who created them. Objects and histories count against the creator of their scene,
// even if another caller sends the updates. Without access control nothing has a creator, and nothing is counted.
//
// Each function hold_*() takes an amount from the creator's quota until the result is destroyed. Keep the result until
// the new scene, mesh or objects are registered; from then on the registry counts them. Errors are RESOURCE_EXHAUSTED
// and name the quota, its value, the use and what to do. No state; any thread.
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

// Returns the creator's name for a scene or mesh that the caller creates: the caller's principal, or an empty text
// without access control.
std::string creator_name(const Caller& caller);

// Takes one scene, and the bytes of the history that `spec` requests.
absl::StatusOr<std::vector<QuotaHold>> hold_scene(Host& host, const SceneSpec& spec);
// Takes the bytes of a mesh.
absl::StatusOr<QuotaHold> hold_mesh_bytes(Host& host, const std::string& creator, uint64_t bytes);
// Takes the objects that the batch inserts. If the quota does not suffice for all of them, takes only the growth of the
// scene: inserts of ids that the scene already has are not counted. Objects that the batch clears or removes by id are
// subtracted, but objects that it removes by group are not.
absl::StatusOr<QuotaHold> hold_objects(Host& host, const Scene& scene, const UpdateBatch& batch);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_CREATOR_QUOTAS_H_
