#include "server/scheduling/idle_scenes.h"

#include <utility>

#include "core/base/check.h"
#include "server/scheduling/clocks.h"

namespace locus::server {
namespace {

using Time = LifetimeKeeper::Time;

std::chrono::seconds idle_ttl(const Scene& scene) { return std::chrono::seconds(scene.spec().idle_ttl_s); }

// Returns the time from which the scene may be deleted. A scene that is in use at `now` cannot be idle before a whole
// idle_ttl_s has passed.
Time due_time(Scene& scene, Time now) {
  const std::optional<uint64_t> since = scene.uses().idle_since();
  return (since ? Time(std::chrono::nanoseconds(*since)) : now) + idle_ttl(scene);
}

}  // namespace

void IdleScenes::watch(const ScenePtr& scene) {
  if (scene->spec().idle_ttl_s == 0) return;
  const Time now = keeper_.now();
  scene->uses().touch(nanoseconds_of(now));
  {
    const MutexLock lock(mutex_);
    if (streams_.contains(scene->name())) scene->uses().begin();
    Watched& watched = watched_[scene->name()];
    if (watched.task != 0) keeper_.remove(watched.task);
    watched.scene = scene;
    watched.task = keeper_.add(now + idle_ttl(*scene),
                               [this, weak = std::weak_ptr<Scene>(scene)](Time time) { return check(weak, time); });
  }
  // A call may have deleted the scene before it was watched.
  const absl::StatusOr<ScenePtr> known = registry_.find_scene(scene->name());
  if (!known.ok() || *known != scene) forget(*scene);
}

void IdleScenes::forget(const Scene& scene) {
  const MutexLock lock(mutex_);
  const auto found = watched_.find(scene.name());
  if (found == watched_.end()) return;
  const ScenePtr watched = found->second.scene.lock();
  if (watched != nullptr && watched.get() != &scene) return;  // a later scene of this name
  keeper_.remove(found->second.task);
  watched_.erase(found);
}

size_t IdleScenes::watched() const {
  const MutexLock lock(mutex_);
  return watched_.size();
}

ScenePtr IdleScenes::watched_scene(const std::string& name) const {
  const auto found = watched_.find(name);
  return found == watched_.end() ? nullptr : found->second.scene.lock();
}

// All streams of a scene count as one use of it, which ends with the last of them.
void IdleScenes::stream_opened(const std::string& name) {
  ScenePtr scene;  // released after the lock
  const MutexLock lock(mutex_);
  if (++streams_[name] > 1) return;
  scene = watched_scene(name);
  if (scene != nullptr) scene->uses().begin();
}

void IdleScenes::stream_closed(const std::string& name) {
  ScenePtr scene;  // released after the lock
  const MutexLock lock(mutex_);
  const auto streams = streams_.find(name);
  LOCUS_CHECK(streams != streams_.end());
  if (--streams->second > 0) return;
  streams_.erase(streams);
  scene = watched_scene(name);
  if (scene != nullptr) scene->uses().end(nanoseconds_of(keeper_.now()));
}

std::optional<IdleScenes::Time> IdleScenes::check(const std::weak_ptr<Scene>& watched, Time now) {
  const ScenePtr scene = watched.lock();
  if (scene == nullptr) return std::nullopt;
  if (const Time due = due_time(*scene, now); due > now) return due;
  bool is_registered = false;
  const absl::StatusOr<bool> deleted = registry_.delete_scene_if(scene, [&] {
    is_registered = true;
    return due_time(*scene, now) <= now;
  });
  if (deleted.ok() && !*deleted && is_registered) return due_time(*scene, now);
  if (!deleted.ok() && is_registered) {
    report_(scene, deleted.status());
    return now + kRetryAfter;
  }
  forget(*scene);
  if (deleted.ok() && *deleted) {
    ++deleted_;
    report_(scene, absl::OkStatus());
  }
  return std::nullopt;
}

}  // namespace locus::server
