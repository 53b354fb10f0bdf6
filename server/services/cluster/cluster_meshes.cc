#include "server/services/cluster/cluster_meshes.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "core/scene/recovery.h"
#include "server/observability/log.h"
#include "server/services/cluster/cluster_scenes.h"

namespace locus::server {
namespace {

// Time after which a caller tries again when the leadership of a scene has ended.
constexpr uint32_t kFencedMs = 50;

}  // namespace

absl::Status ClusterMeshes::forget_stale(const std::string& name) {
  const MutexLock lock(mutex_);
  ASSIGN_OR_RETURN(const std::optional<StoredMesh> stored, log_.find_stored_mesh(name));
  const absl::StatusOr<MeshPtr> known = host_.registry.find_mesh(name, "mesh");
  if (!stored || (known.ok() && (*known)->sha256() != stored->sha256)) host_.registry.drop_mesh(name);
  return absl::OkStatus();
}

absl::StatusOr<MeshPtr> ClusterMeshes::refresh(const std::string& name, absl::string_view field) {
  const MutexLock lock(mutex_);
  ASSIGN_OR_RETURN(const std::optional<StoredMesh> stored, log_.find_stored_mesh(name));
  const absl::StatusOr<MeshPtr> known = host_.registry.find_mesh(name, field);
  if (stored && known.ok() && (*known)->sha256() == stored->sha256) return known;
  host_.registry.drop_mesh(name);
  if (!stored) return host_.registry.find_mesh(name, field);
  if (!stored->damage.ok()) return stored->damage;
  MeshPtr content = host_.registry.find_content(stored->sha256);
  if (content == nullptr) {
    BvhOptions options;
    options.parallel_for = [this](size_t n, const std::function<void(size_t)>& work) {
      host_.pool.parallel_for(n, work);
    };
    ASSIGN_OR_RETURN(const RecoveredMesh recovered, recover_mesh(log_, *stored, options));
    content = recovered.mesh;
  }
  ASSIGN_OR_RETURN(MeshPtr mesh, recover_name(log_, *stored, content));
  host_.registry.restore_mesh(name, std::move(mesh), stored->grace_s);
  return host_.registry.find_mesh(name, field);
}

absl::Status ClusterMeshes::claim(const Scene& scene, const StaticChange& change) {
  if (change.place.empty()) return absl::OkStatus();
  std::map<std::string, MeshUse> uses;
  for (const PlacementColumns& place : change.place) {
    MeshUse& use = uses[place.mesh->name()];
    use.name = place.mesh->name();
    use.sha256 = place.mesh->sha256();
    use.instances += place.count();
  }
  std::vector<MeshUse> claimed;
  for (auto& [name, use] : uses) claimed.push_back(std::move(use));
  const MutexLock lock(claims_mutex_);
  const SceneKey key = host_.cluster->key_of(scene);
  const absl::Status status = key == 0 ? absl::AbortedError("") : log_.claim_meshes(key, claimed);
  if (absl::IsAborted(status)) return no_leader("another server has become the leader of the scene", kFencedMs);
  return status;
}

void ClusterMeshes::release_unused(const Scene& scene) {
  const MutexLock lock(claims_mutex_);
  const SceneKey key = host_.cluster->key_of(scene);
  if (key == 0) return;
  absl::flat_hash_set<const StaticMesh*> meshes;
  scene.add_used_meshes(meshes);
  const SnapshotPtr latest = scene.latest();
  std::vector<MeshUse> uses;
  for (const StaticMesh* mesh : meshes) {
    if (!scene.in_use(mesh)) continue;  // only the history has it
    uses.push_back({mesh->name(), mesh->sha256(), std::max<uint64_t>(1, latest->statics->uses(mesh))});
  }
  const absl::Status status = log_.set_mesh_uses(key, uses);
  if (!status.ok() && !absl::IsAborted(status))
    log(LogLevel::kWarning, "the uses of meshes could not be stored; unused ones cannot be deleted yet",
        {{"scene", scene.name()}, {"why", std::string(status.message())}});
}

}  // namespace locus::server
