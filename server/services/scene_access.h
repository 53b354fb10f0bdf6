// Functions that find the scene of a call, count its use, wait for a revision of the scene, and wait for the scene's
// readers. No state; any thread.
#ifndef LOCUS_SERVER_SERVICES_SCENE_ACCESS_H_
#define LOCUS_SERVER_SERVICES_SCENE_ACCESS_H_

#include <cstddef>
#include <functional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "core/scene/scene.h"
#include "server/host/host.h"
#include "server/rpc/call.h"
#include "server/scheduling/clocks.h"

namespace locus::server {

// Permission of a lookup to wait for the engine of a cluster, for about a second, to find out who has a scene.
enum class LookUp : uint8_t { kNeverWaits, kMayWait };

// Checks the scene's name, the metadata x-scene and the caller's right to the scene, then returns the scene. `field` is
// the field of the request that contains the name; the error for a malformed name repeats `field`. In a cluster, a
// scene that this daemon does not have is FAILED_PRECONDITION (ELSEWHERE) or UNAVAILABLE (NO_LEADER).
absl::StatusOr<ScenePtr> find_scene(const Host& host, const Caller& caller, const std::string& name,
                                    absl::string_view field, LookUp look_up = LookUp::kNeverWaits);

// Scene that a call uses. The use of a scene with idle_ttl_s is counted until reset() or the destructor, so that the
// scene is not deleted as idle meanwhile. One thread at a time.
class UsedScene {
 public:
  UsedScene() = default;
  explicit UsedScene(ScenePtr scene) : scene_(std::move(scene)) {
    if (is_counted()) scene_->uses().begin();
  }
  UsedScene(UsedScene&& other) noexcept : scene_(std::move(other.scene_)) {}
  UsedScene& operator=(UsedScene&& other) noexcept {
    std::swap(scene_, other.scene_);
    return *this;
  }
  ~UsedScene() { reset(); }
  UsedScene(const UsedScene&) = delete;
  UsedScene& operator=(const UsedScene&) = delete;

  // Ends the use and releases the scene.
  void reset() {
    if (is_counted()) scene_->uses().end(steady_nanoseconds());
    scene_.reset();
  }
  // NOLINTNEXTLINE(google-explicit-constructor): a UsedScene is used in place of a ScenePtr
  operator const ScenePtr&() const { return scene_; }
  friend bool operator==(const UsedScene& scene, std::nullptr_t) { return scene.scene_ == nullptr; }
  Scene& operator*() const { return *scene_; }
  Scene* operator->() const { return scene_.get(); }

 private:
  bool is_counted() const { return scene_ != nullptr && scene_->spec().idle_ttl_s != 0; }

  ScenePtr scene_;
};

// Returns the number of values that a query by list tests; never 0.
inline uint64_t tested_by_list(const SceneSnapshot& snapshot) {
  return 1 + snapshot.statics->triangle_count() + snapshot.objects.size();
}

// Returns the scene that find_scene() returns, for a call that uses it.
absl::StatusOr<UsedScene> use_scene(const Host& host, const Caller& caller, const std::string& name,
                                    absl::string_view field, LookUp look_up = LookUp::kNeverWaits);

// Returns the mesh of this name, or NOT_FOUND naming the field `mesh`. In a cluster, reads it from the engine if this
// daemon has not read it or has read another one of the name; may wait.
absl::StatusOr<MeshPtr> find_mesh(const Host& host, const std::string& name);

// Claims `bytes` for responses that copy parts of scenes or meshes. A claim of up to 64 KiB uses MemoryLine::kReplies,
// whose claims are refused last; a larger claim uses `line`.
absl::StatusOr<CallMemory> claim_copy(const Caller& caller, uint64_t bytes, MemoryLine line = MemoryLine::kDumps);

// Waits for the revision that `view` names, but at most until the time `until`, and pins the revision's snapshot.
// Returns at once when the revision is published or the scene is deleted, and within 50 ms when the call ends or the
// server drains. If the server drains, the error is UNAVAILABLE with the reason DRAINING.
absl::StatusOr<SnapshotPin> wait_for(const Scene& scene, const View& view, SteadyTime until, const Caller& caller);

// Waits for the readers whose pins on snapshots of the scene were revoked, until they have released these pins. After
// the first second of the wait, calls Scene::revoke_overdue_readers() repeatedly. Calls `stop` every 50 ms. If `stop`
// returns DEADLINE_EXCEEDED, returns the scene's error, which names the limit pinned_bytes; returns any other error of
// `stop` unchanged.
absl::Status wait_for_readers(Scene& scene, const std::function<absl::Status()>& stop);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SCENE_ACCESS_H_
