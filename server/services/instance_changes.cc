#include "server/services/instance_changes.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <random>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

// Interval at which a waiting call checks whether its caller has given up.
constexpr std::chrono::milliseconds kCancellationCheck{50};

// Result of a background change, handed to the call that waits for it. The call may have ended before the result comes.
class Outcome {
 public:
  void set(absl::StatusOr<InstanceChange> change) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    change_ = std::move(change);
    known_.notify_all();
  }

  // Returns the result of the change, or the status that ended the call. In the latter case the change continues.
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

// A change together with the message that its columns point into.
struct OwnedChange {
  v1::ChangeInstancesRequest request;
  StaticChange change;
};

size_t placement_count(const v1::Placement& placement) {
  return static_cast<size_t>(placement.ids().empty() ? placement.translations_size() / 3 : placement.ids_size());
}

absl::StatusOr<PlacementColumns> to_placement(const Registry& registry, const v1::Placement& placement,
                                              const std::string& field) {
  RETURN_IF_ERROR(check_mesh_name(placement.mesh(), field + ".mesh"));
  ASSIGN_OR_RETURN(MeshPtr mesh, registry.find_mesh(placement.mesh(), field + ".mesh"));
  PlacementColumns columns;
  columns.mesh = std::move(mesh);
  columns.ids = span_of(placement.ids());
  columns.translations = span_of(placement.translations());
  columns.rotations = span_of(placement.rotations());
  columns.scales = span_of(placement.scales());
  columns.layers = span_of(placement.layers());
  columns.groups = span_of(placement.groups());
  columns.tags = span_of(placement.tags());
  return columns;
}

// Chooses ids for placements without ids. With no_wait the reply carries the ids before the change is built, so they
// are drawn here: kChosenIdBit and 63 random bits below it.
void choose_ids(v1::ChangeInstancesRequest& request) {
  std::random_device device;
  for (v1::Placement& placement : *request.mutable_place()) {
    if (!placement.ids().empty()) continue;
    const size_t n = placement_count(placement);
    for (size_t i = 0; i < n; ++i) placement.add_ids(kChosenIdBit | uint64_t{device()} << 32 | device());
  }
}

absl::StatusOr<std::shared_ptr<OwnedChange>> read_change(const Registry& registry,
                                                         const v1::ChangeInstancesRequest& request) {
  auto owned = std::make_shared<OwnedChange>();
  owned->request = request;
  if (request.no_wait()) choose_ids(owned->request);
  owned->change.remove_ids = span_of(owned->request.remove_ids());
  owned->change.remove_groups = span_of(owned->request.remove_groups());
  for (int i = 0; i < owned->request.place_size(); ++i) {
    ASSIGN_OR_RETURN(PlacementColumns placement,
                     to_placement(registry, owned->request.place(i), absl::StrCat("place[", i, "]")));
    owned->change.place.push_back(std::move(placement));
  }
  return owned;
}

// Checks the placements of a change before the changes queued ahead of it are applied, so only as far as that is
// possible: applies the placements to an empty set of instances.
absl::Status check_placements(const StaticChange& change) {
  StaticChange placements_only;
  placements_only.place = change.place;
  return StaticSet::empty()
      ->apply(
          placements_only, [](Id) { return false; }, 0)
      .status();
}

using SharedClaim = std::shared_ptr<const MemoryBudget::Claim>;

// Claims memory for building the new set of instances. A change that only removes instances is never refused.
absl::StatusOr<SharedClaim> make_room(Host& host, const Scene& scene, const StaticChange& change) {
  const uint64_t cost = change_cost(*scene.latest()->statics, change);
  if (cost == 0) return nullptr;
  ASSIGN_OR_RETURN(MemoryBudget::Claim claim, host.memory.claim("place", cost));
  return std::make_shared<const MemoryBudget::Claim>(std::move(claim));
}

void log_failure(const Scene& scene, uint64_t number, const absl::StatusOr<InstanceChange>& change) {
  if (change.ok()) return;
  log(LogLevel::kInfo, "change of instances failed",
      {{"scene", scene.name()}, {"change", absl::StrCat(number)}, {"text", std::string(change.status().message())}});
}

}  // namespace

absl::Status change_instances(Host& host, const Caller& caller, const v1::ChangeInstancesRequest& request,
                              v1::ChangeInstancesResponse* response) {
  const absl::StatusOr<ScenePtr> scene = find_scene(caller, request.scene(), "scene");
  if (!scene.ok()) return scene.status();
  absl::StatusOr<std::shared_ptr<OwnedChange>> owned = read_change(host.registry, request);
  if (!owned.ok()) return owned.status();
  if (request.no_wait()) RETURN_IF_ERROR(check_placements((*owned)->change));
  const absl::StatusOr<SharedClaim> room = make_room(host, **scene, (*owned)->change);
  if (!room.ok()) return room.status();
  const auto outcome = std::make_shared<Outcome>();
  const uint64_t epoch = (*scene)->latest()->epoch;
  ASSIGN_OR_RETURN(
      const uint64_t number,
      host.changes.submit(epoch, [&host, arrived = SteadyTime::clock::now(), scene = *scene, owned = *owned, outcome,
                                  room = *room, trace = LogScope::current()](uint64_t change_number) {
        const LogScope scope(trace);
        // Wait without a deadline: the change runs even if its caller has given up, and readers release their snapshots
        // in any case.
        (void)wait_for_readers(*scene, [] { return absl::OkStatus(); });
        absl::StatusOr<InstanceChange> change = scene->change_instances(owned->change);
        if (change.ok()) host.metrics.record_instance_change(nanoseconds_since(arrived));
        log_failure(*scene, change_number, change);
        outcome->set(std::move(change));
      }));
  response->set_change(number);
  response->set_epoch(epoch);
  if (request.no_wait()) {
    for (const v1::Placement& placement : (*owned)->request.place())
      response->mutable_ids()->MergeFrom(placement.ids());
    return absl::OkStatus();
  }
  ASSIGN_OR_RETURN(const InstanceChange change, outcome->wait(caller));
  response->mutable_ids()->Add(change.placed.begin(), change.placed.end());
  response->set_revision(change.revision);
  return absl::OkStatus();
}

v1::Scene describe(const Host& host, const Scene& scene) {
  v1::Scene out = to_proto(scene);
  // The queue's count includes the change that the scene is building now.
  const uint32_t pending = std::max(out.pending_changes(), host.changes.pending(out.epoch()));
  out.set_pending_changes(pending);
  out.set_state(pending > 0 ? v1::SCENE_STATE_BUILDING : v1::SCENE_STATE_READY);
  return out;
}

}  // namespace locus::server
