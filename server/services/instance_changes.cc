#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/observability/log.h"
#include "server/services/cluster/cluster_meshes.h"
#include "server/services/scene_access.h"
#include "server/services/scene_calls.h"

namespace locus::server {
namespace {

// Size in bytes up to which a change that only removes instances is never refused for lack of memory.
constexpr uint64_t kSmallChangeBytes = 64u << 10;

// Upper bound in bytes of the memory for one id of the response. The id exists three times: in the result of the
// change, in the response message, and in the message's serialized bytes.
constexpr uint64_t kReplyBytesAPlacement = 40;

// Interval at which a waiting call checks whether its caller has given up.
constexpr std::chrono::milliseconds kCancellationCheck{50};

// Result of a background change, for the call that waits for it. The call may end before the result is set.
class Outcome {
 public:
  void set(absl::StatusOr<InstanceChange> change) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    change_ = std::move(change);
    known_.notify_all();
  }

  // Returns the result of the change, or the status that ended the call. If the call has ended, the change continues.
  absl::StatusOr<InstanceChange> wait(const Caller& caller) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    while (!change_) {
      RETURN_IF_ERROR(caller.stop());
      known_.wait_until(mutex_, std::min(caller.deadline(), std::chrono::steady_clock::now() + kCancellationCheck));
    }
    return *change_;
  }

 private:
  Mutex mutex_;
  ConditionVariable known_;
  std::optional<absl::StatusOr<InstanceChange>> change_ LOCUS_GUARDED_BY(mutex_);
};

// A change together with the message that its columns point into. Its meshes are not deleted as long as it exists.
struct OwnedChange {
  v1::ChangeInstancesRequest request;
  StaticChange change;
  std::optional<Scene::ExpectedMeshes> meshes;
};

size_t placement_count(const v1::Placement& placement) {
  return static_cast<size_t>(placement.ids().empty() ? placement.translations_size() / 3 : placement.ids_size());
}

uint64_t placed_count(const v1::ChangeInstancesRequest& request) {
  uint64_t placed = 0;
  for (const v1::Placement& placement : request.place()) placed += placement_count(placement);
  return placed;
}

// Chooses ids for placements without ids. With `no_wait` the reply contains the ids although the change is not built
// yet, so the ids are chosen here.
void choose_ids(Scene& scene, v1::ChangeInstancesRequest& request) {
  for (v1::Placement& placement : *request.mutable_place()) {
    if (!placement.ids().empty()) continue;
    const std::vector<Id> ids = scene.choose_ids(placement_count(placement));
    placement.mutable_ids()->Add(ids.begin(), ids.end());
  }
}

absl::StatusOr<std::shared_ptr<OwnedChange>> read_change(const ScenePtr& scene, const Registry& registry,
                                                         const v1::ChangeInstancesRequest& request) {
  auto owned = std::make_shared<OwnedChange>();
  owned->request = request;
  if (request.no_wait()) choose_ids(*scene, owned->request);
  ASSIGN_OR_RETURN(owned->change, to_change(owned->request, registry));
  owned->meshes.emplace(scene, owned->change);
  return owned;
}

using SharedClaim = std::shared_ptr<const CallMemory>;
// The use of the scene by a call and by the change that it queues.
using SharedUse = std::shared_ptr<const UsedScene>;

// Claims memory for the change before any memory is allocated for it: for the queued copy of the change, for its check,
// and for building the new set of instances. A small change that only removes instances is never refused.
absl::StatusOr<SharedClaim> make_room(const Caller& caller, const Scene& scene,
                                      const v1::ChangeInstancesRequest& request) {
  const uint64_t placed = placed_count(request);
  const uint64_t cost = change_cost(scene.latest()->statics->size(), placed);
  const uint64_t queued = request.SpaceUsedLong() + placed * sizeof(Id);
  if (cost == 0 && queued <= kSmallChangeBytes)
    return std::make_shared<const CallMemory>(caller.claim_anyway(MemoryLine::kBuilds, queued));
  ASSIGN_OR_RETURN(CallMemory claim, caller.claim(MemoryLine::kBuilds, "place", cost + queued));
  return std::make_shared<const CallMemory>(std::move(claim));
}

void log_failure(const Scene& scene, uint64_t number, const absl::StatusOr<InstanceChange>& change) {
  if (change.ok()) return;
  log(LogLevel::kInfo, "change of instances failed",
      {{"scene", scene.name()}, {"change", absl::StrCat(number)}, {"text", std::string(change.status().message())}});
}

bool removes(const StaticChange& change) { return !change.remove_ids.empty() || !change.remove_groups.empty(); }

// Queues the change together with the claim of its memory. Returns the change's number.
absl::StatusOr<uint64_t> submit(Host& host, const SharedUse& scene, uint64_t epoch, std::shared_ptr<OwnedChange> owned,
                                SharedClaim room, std::shared_ptr<Outcome> outcome) {
  return host.changes.submit(
      epoch, [&host, arrived = SteadyTime::clock::now(), scene, owned = std::move(owned), room = std::move(room),
              outcome = std::move(outcome), trace = LogScope::current()](uint64_t number) {
        const LogScope scope(trace);
        // Wait without a deadline: the change runs even if its caller has given up, and revoked readers release their
        // snapshots in any case.
        (void)wait_for_readers(**scene, [] { return absl::OkStatus(); });
        absl::StatusOr<InstanceChange> change = (*scene)->change_instances(owned->change);
        owned->meshes.reset();  // before the caller knows the outcome, and may delete a mesh
        if (change.ok()) {
          host.metrics.record_instance_change(nanoseconds_since(arrived));
          host.mesh_collector.instances_changed(**scene);
        }
        if (host.cluster_meshes != nullptr && (!change.ok() || removes(owned->change)))
          host.cluster_meshes->release_unused(**scene);
        log_failure(**scene, number, change);
        outcome->set(std::move(change));
      });
}

// Reads the meshes that a change places from the engine of a cluster. Missing ones are left to to_change(), whose error
// names the field.
absl::Status read_meshes(Host& host, const v1::ChangeInstancesRequest& request) {
  if (host.cluster_meshes == nullptr) return absl::OkStatus();
  for (const v1::Placement& placement : request.place()) {
    const absl::Status read = host.cluster_meshes->refresh(placement.mesh(), "mesh").status();
    if (!absl::IsNotFound(read)) RETURN_IF_ERROR(read);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status change_instances(Host& host, const Caller& caller, const v1::ChangeInstancesRequest& request,
                              MessageStream& stream) {
  caller.set_subject(request.scene());
  ASSIGN_OR_RETURN(UsedScene found, use_scene(host, caller, request.scene(), "scene", LookUp::kMayWait));
  const auto scene = std::make_shared<const UsedScene>(std::move(found));
  ASSIGN_OR_RETURN(SharedClaim room, make_room(caller, **scene, request));
  // Held until the response is written.
  ASSIGN_OR_RETURN(const CallMemory reply, claim_copy(caller, placed_count(request) * kReplyBytesAPlacement));
  for (const v1::Placement& placement : request.place()) host.mesh_collector.renew(placement.mesh());
  RETURN_IF_ERROR(read_meshes(host, request));
  ASSIGN_OR_RETURN(const std::shared_ptr<OwnedChange> owned, read_change(*scene, host.registry, request));
  // Check the placements without the scene's instances, because changes that were queued earlier may still alter those
  // instances.
  if (request.no_wait()) RETURN_IF_ERROR(StaticSet::check_placements(owned->change.place));
  if (host.cluster_meshes != nullptr) RETURN_IF_ERROR(host.cluster_meshes->claim(**scene, owned->change));
  const auto outcome = std::make_shared<Outcome>();
  const uint64_t epoch = (*scene)->latest()->epoch;
  const absl::StatusOr<uint64_t> number = submit(host, scene, epoch, owned, std::move(room), outcome);
  if (!number.ok() && host.cluster_meshes != nullptr) {
    owned->meshes.reset();
    host.cluster_meshes->release_unused(**scene);
  }
  RETURN_IF_ERROR(number.status());
  v1::ChangeInstancesResponse response;
  response.set_change(*number);
  response.set_epoch(epoch);
  if (request.no_wait()) {
    for (const v1::Placement& placement : owned->request.place()) response.mutable_ids()->MergeFrom(placement.ids());
  } else {
    ASSIGN_OR_RETURN(const InstanceChange change, outcome->wait(caller));
    response.mutable_ids()->Add(change.placed.begin(), change.placed.end());
    response.set_revision(change.revision);
  }
  stream.write(response);
  return absl::OkStatus();
}

}  // namespace locus::server
