// Deletes scenes that no call has used for SceneSpec::idle_ttl_s seconds, as Registry::delete_scene() does. Calls
// record their use in Scene::uses(), without a lock; open streams are counted here, by the name of their scene.
//
// Threads: every member may be called from any thread. The locks of this class are held only briefly; it calls the
// registry without them. Invariants: a scene is deleted only if its last use ended at least its time ago, at a moment
// at which no change of the scene is being applied, no call has begun and not ended, and no stream is open; each
// watched scene is deleted at most once.
#ifndef LOCUS_SERVER_SCHEDULING_IDLE_SCENES_H_
#define LOCUS_SERVER_SCHEDULING_IDLE_SCENES_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/container/flat_hash_map.h"
#include "core/base/mutex.h"
#include "core/scene/registry.h"
#include "server/scheduling/lifetime_keeper.h"

namespace locus::server {

class IdleScenes {
 public:
  // Function that is called on the keeper's thread after a scene was deleted, or with the log's error if it could not
  // be deleted; then the deletion is tried again after kRetryAfter.
  using Report = std::function<void(const ScenePtr& scene, const absl::Status& status)>;
  static constexpr std::chrono::seconds kRetryAfter{5};

  // `keeper` and `registry` must outlive the calls of this object's tasks, which end with the keeper's thread.
  IdleScenes(LifetimeKeeper& keeper, Registry& registry, Report report)
      : keeper_(keeper), registry_(registry), report_(std::move(report)) {}

  // Begins to watch a scene that was created or restored. Its time begins now. Does nothing if it has no idle_ttl_s.
  void watch(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_);
  // Ends the watch of a scene that was deleted.
  void forget(const Scene& scene) LOCUS_EXCLUDES(mutex_);
  // Returns the number of watched scenes.
  size_t watched() const LOCUS_EXCLUDES(mutex_);
  // Returns the number of scenes deleted so far.
  uint64_t deleted() const { return deleted_.load(); }

  // Count the streams that serve the scene of this name, now or when it is created. While a stream is open, its scene
  // is in use.
  void stream_opened(const std::string& name) LOCUS_EXCLUDES(mutex_);
  void stream_closed(const std::string& name) LOCUS_EXCLUDES(mutex_);

 private:
  using Time = LifetimeKeeper::Time;
  struct Watched {
    std::weak_ptr<Scene> scene;
    LifetimeKeeper::TaskId task = 0;
  };

  // Deletes the scene if it is idle. Returns the time of the next check.
  std::optional<Time> check(const std::weak_ptr<Scene>& watched, Time now) LOCUS_EXCLUDES(mutex_);
  // Returns the watched scene of this name, or null.
  ScenePtr watched_scene(const std::string& name) const LOCUS_REQUIRES(mutex_);

  LifetimeKeeper& keeper_;
  Registry& registry_;
  const Report report_;
  std::atomic<uint64_t> deleted_{0};
  mutable Mutex mutex_;
  absl::flat_hash_map<std::string, Watched> watched_ LOCUS_GUARDED_BY(mutex_);
  absl::flat_hash_map<std::string, uint32_t> streams_ LOCUS_GUARDED_BY(mutex_);  // open streams; no entry with 0
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_IDLE_SCENES_H_
