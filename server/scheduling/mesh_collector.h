// Deletes meshes that scenes with SceneSpec::mesh_grace_s have used and that no scene uses any more, as
// Registry::delete_mesh() does. The registry records which meshes may be deleted, and after what time:
// Registry::make_collectable(). The latest revision, the history and pending changes of a scene use a mesh.
//
// Uses end without an event, for example when the history drops a tick, so the collector checks the meshes in use at
// intervals of an eighth of their time. The time of a mesh begins at the first check that finds it unused. So a mesh is
// deleted after its time, never earlier, and at most about an eighth later (kMinCheck, kMaxCheck).
//
// Threads: every member may be called from any thread. The lock of this class is held only briefly; while the
// registry's lock is held, it may be taken, but not the other way round. Invariant: a mesh is deleted only if no scene
// has used it, and renew() was not called for it, for its whole time.
#ifndef LOCUS_SERVER_SCHEDULING_MESH_COLLECTOR_H_
#define LOCUS_SERVER_SCHEDULING_MESH_COLLECTOR_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/base/mutex.h"
#include "core/scene/registry.h"
#include "server/scheduling/lifetime_keeper.h"

namespace locus::server {

class MeshCollector {
 public:
  struct Reports {
    // Called on the keeper's thread after a mesh was deleted, or with the log's error if it could not be deleted; then
    // the deletion is tried again after kRetryAfter.
    std::function<void(const std::string& mesh, const absl::Status& status)> deleted;
    // Called by start() and instances_changed() with the log's error if meshes of a scene could not be recorded as
    // meshes that may be deleted. They are recorded at the next change of the scene's instances, or after a restart.
    std::function<void(const Scene& scene, const absl::Status& status)> not_marked;
  };
  static constexpr std::chrono::seconds kRetryAfter{5};
  // Minimum and maximum interval between two checks of a mesh that is in use.
  static constexpr std::chrono::milliseconds kMinCheck{100};
  static constexpr std::chrono::seconds kMaxCheck{60};

  // `keeper` and `registry` must outlive the calls of this object's task, which end with the keeper's thread.
  MeshCollector(LifetimeKeeper& keeper, Registry& registry, Reports reports)
      : keeper_(keeper), registry_(registry), reports_(std::move(reports)) {}

  // Begins to collect. Records the meshes of all scenes with mesh_grace_s, because a crash may have lost a record. Call
  // once, when the scenes are restored.
  void start() LOCUS_EXCLUDES(mutex_);

  // Call after a scene was created, and after its instances were changed. If the scene has mesh_grace_s, records that
  // its meshes may be deleted, with one write to the log. Renews the meshes.
  void instances_changed(const Scene& scene) LOCUS_EXCLUDES(mutex_);
  // Begins the time of a mesh again. Call before a mesh of this name is looked up to be placed, or to answer its
  // upload. From then on the mesh, if it is found, is not deleted for its whole time.
  void renew(const std::string& mesh) LOCUS_EXCLUDES(mutex_);
  // Returns the number of meshes deleted so far.
  uint64_t deleted() const { return deleted_.load(); }

 private:
  using Time = LifetimeKeeper::Time;
  // A collectable mesh that no scene has used, and that was not renewed, since a check found it unused.
  struct Unused {
    const StaticMesh* mesh = nullptr;  // compared, but never used: the mesh may be deleted
    uint32_t grace_s = 0;
    Time since;
  };

  std::optional<Time> check(Time now) LOCUS_EXCLUDES(mutex_);
  // Compares the collectable meshes with the meshes in use. Adds the meshes that are due to `due` and returns the time
  // of the next check, unless one of them is due.
  Time compare(Time now, std::vector<Registry::CollectableMesh>& due) LOCUS_EXCLUDES(mutex_);
  // Returns false if the log failed.
  bool collect(const Registry::CollectableMesh& mesh, Time now) LOCUS_EXCLUDES(mutex_);
  // Returns whether no scene has used the mesh for its whole time.
  bool is_due(const Registry::CollectableMesh& mesh, Time now) const LOCUS_REQUIRES(mutex_);
  // Makes the next check of a mesh of this grace at the latest after its interval.
  void check_soon(uint32_t grace_s) LOCUS_REQUIRES(mutex_);

  LifetimeKeeper& keeper_;
  Registry& registry_;
  const Reports reports_;
  std::atomic<uint64_t> deleted_{0};
  mutable Mutex mutex_;
  LifetimeKeeper::TaskId task_ LOCUS_GUARDED_BY(mutex_) = 0;                  // 0: start() was not called
  absl::flat_hash_map<std::string, Unused> unused_ LOCUS_GUARDED_BY(mutex_);  // collectable meshes, by name
  // Meshes that were renewed while compare() runs, which may not have seen their use.
  bool comparing_ LOCUS_GUARDED_BY(mutex_) = false;
  absl::flat_hash_set<std::string> renewed_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_MESH_COLLECTOR_H_
