#include "server/services/scene_access.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/names.h"
#include "core/base/status_macros.h"
#include "server/convert/status.h"
#include "server/services/cluster/cluster_meshes.h"
#include "server/services/cluster/cluster_scenes.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Interval at which a waiting thread checks whether its call has ended.
constexpr milliseconds kWaitSlice{50};
// Time that wait_for_readers() gives readers to release revoked snapshots before it calls revoke_overdue_readers().
constexpr milliseconds kReadersMayTake{1000};

}  // namespace

absl::StatusOr<ScenePtr> find_scene(const Host& host, const Caller& caller, const std::string& name,
                                    absl::string_view field, LookUp look_up) {
  RETURN_IF_ERROR(check_scene_name(name, field));
  RETURN_IF_ERROR(caller.check_scene(name));
  if (absl::Status status = caller.check_right(name); !status.ok()) {
    if (absl::IsNotFound(status)) caller.audit_hidden(name);
    return status;
  }
  absl::StatusOr<ScenePtr> scene = host.registry.find_scene(name);
  if (host.cluster == nullptr || !absl::IsNotFound(scene.status())) return scene;
  return look_up == LookUp::kMayWait ? host.cluster->wait_for(name, caller.deadline()) : host.cluster->missing(name);
}

absl::StatusOr<UsedScene> use_scene(const Host& host, const Caller& caller, const std::string& name,
                                    absl::string_view field, LookUp look_up) {
  ASSIGN_OR_RETURN(ScenePtr scene, find_scene(host, caller, name, field, look_up));
  return UsedScene(std::move(scene));
}

absl::StatusOr<MeshPtr> find_mesh(const Host& host, const std::string& name) {
  if (host.cluster_meshes == nullptr) return host.registry.find_mesh(name, "mesh");
  return host.cluster_meshes->refresh(name, "mesh");
}

absl::StatusOr<CallMemory> claim_copy(const Caller& caller, uint64_t bytes, MemoryLine line) {
  constexpr uint64_t kSmallCopy = 64u << 10;
  return caller.claim(bytes <= kSmallCopy ? MemoryLine::kReplies : line, "", bytes);
}

absl::StatusOr<SnapshotPin> wait_for(const Scene& scene, const View& view, SteadyTime until, const Caller& caller) {
  while (true) {
    const SteadyTime slice = std::min(until, steady_clock::now() + kWaitSlice);
    absl::StatusOr<SnapshotPin> snapshot = scene.pin(view, slice);
    if (snapshot.status().code() != absl::StatusCode::kDeadlineExceeded || slice == until) return snapshot;
    RETURN_IF_ERROR(caller.stop());
    if (caller.state().drain.draining()) return draining();
  }
}

absl::Status wait_for_readers(Scene& scene, const std::function<absl::Status()>& stop) {
  const SteadyTime start = steady_clock::now();
  while (true) {
    const SteadyTime now = steady_clock::now();
    absl::Status late = scene.wait_for_readers(now + kWaitSlice);
    if (late.ok()) return late;
    absl::Status stopped = stop();
    if (stopped.code() == absl::StatusCode::kDeadlineExceeded) return late;
    RETURN_IF_ERROR(stopped);
    if (now - start > kReadersMayTake) scene.revoke_overdue_readers();
  }
}

}  // namespace locus::server
