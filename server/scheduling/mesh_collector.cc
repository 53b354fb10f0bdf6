#include "server/scheduling/mesh_collector.h"

#include <algorithm>
#include <limits>

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

LifetimeKeeper::Time::duration check_interval(uint32_t grace_s) {
  return std::clamp<milliseconds>(milliseconds(seconds(grace_s)) / 8, MeshCollector::kMinCheck,
                                  MeshCollector::kMaxCheck);
}

}  // namespace

void MeshCollector::start() {
  {
    const MutexLock lock(mutex_);
    task_ = keeper_.add(keeper_.now(), [this](Time now) { return check(now); });
  }
  for (const ScenePtr& scene : registry_.list_scenes("", std::numeric_limits<size_t>::max())) instances_changed(*scene);
}

void MeshCollector::instances_changed(const Scene& scene) {
  const uint32_t grace_s = scene.spec().mesh_grace_s;
  const SnapshotPtr snapshot = scene.latest();  // keeps the meshes alive
  const std::vector<const StaticMesh*> meshes = snapshot->statics->meshes();
  for (const StaticMesh* mesh : meshes) renew(mesh->name());
  if (grace_s == 0 || meshes.empty()) return;
  if (const absl::Status status = registry_.make_collectable(meshes, grace_s); !status.ok())
    reports_.not_marked(scene, status);
  const MutexLock lock(mutex_);
  check_soon(grace_s);
}

void MeshCollector::renew(const std::string& mesh) {
  const MutexLock lock(mutex_);
  if (comparing_) renewed_.insert(mesh);
  const auto unused = unused_.find(mesh);
  if (unused == unused_.end()) return;
  check_soon(unused->second.grace_s);
  unused_.erase(unused);
}

void MeshCollector::check_soon(uint32_t grace_s) {
  if (task_ != 0) keeper_.expedite(task_, keeper_.now() + check_interval(grace_s));
}

std::optional<MeshCollector::Time> MeshCollector::check(Time now) {
  std::vector<Registry::CollectableMesh> due;
  Time next = compare(now, due);
  for (const Registry::CollectableMesh& mesh : due)
    next = std::min<Time>(next, now + (collect(mesh, now) ? check_interval(mesh.grace_s) : kRetryAfter));
  return next;
}

MeshCollector::Time MeshCollector::compare(Time now, std::vector<Registry::CollectableMesh>& due) {
  // The meshes of a damaged scene are not known. The scene needs them after a repair.
  if (!registry_.damaged_scenes().empty()) return now + kMaxCheck;
  {
    const MutexLock lock(mutex_);
    comparing_ = true;
    renewed_.clear();
  }
  const std::vector<Registry::CollectableMesh> meshes = registry_.collectable_meshes();
  const absl::flat_hash_set<const StaticMesh*> used = registry_.used_meshes();
  const Time seen = keeper_.now();  // a mesh that is not in `used` was unused at some time before
  Time next = Time::max();
  absl::flat_hash_map<std::string, Unused> unused;
  const MutexLock lock(mutex_);
  for (const Registry::CollectableMesh& collectable : meshes) {
    const StaticMesh* const mesh = collectable.mesh.get();
    Time check_at = now + check_interval(collectable.grace_s);
    if (!used.contains(mesh) && !renewed_.contains(mesh->name())) {
      Unused state{mesh, collectable.grace_s, seen};
      const auto known = unused_.find(mesh->name());
      if (known != unused_.end() && known->second.mesh == mesh) state.since = known->second.since;
      unused.emplace(mesh->name(), state);
      check_at = state.since + seconds(collectable.grace_s);
    }
    if (check_at <= now)
      due.push_back(collectable);
    else
      next = std::min(next, check_at);
  }
  unused_ = std::move(unused);
  comparing_ = false;
  return next;
}

bool MeshCollector::is_due(const Registry::CollectableMesh& mesh, Time now) const {
  const auto unused = unused_.find(mesh.mesh->name());
  return unused != unused_.end() && unused->second.mesh == mesh.mesh.get() &&
         unused->second.since + seconds(mesh.grace_s) <= now;
}

bool MeshCollector::collect(const Registry::CollectableMesh& mesh, Time now) {
  const absl::StatusOr<bool> deleted = registry_.delete_mesh_if(mesh.mesh, [&] {
    const MutexLock lock(mutex_);
    return is_due(mesh, now);
  });
  if (deleted.ok() && *deleted) ++deleted_;
  if (!deleted.ok() || *deleted) reports_.deleted(mesh.mesh->name(), deleted.status());
  return deleted.ok();
}

}  // namespace locus::server
