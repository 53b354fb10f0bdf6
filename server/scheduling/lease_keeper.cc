#include "server/scheduling/lease_keeper.h"

#include <algorithm>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "server/scheduling/clocks.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

// Returns the length of the writer's lease, or nullopt if it has none.
std::optional<milliseconds> length_of(const Scene& scene, uint64_t writer) {
  const Scene::LeaseList list = scene.leases();
  const auto found = std::lower_bound(list->begin(), list->end(), writer,
                                      [](const locus::Lease& lease, uint64_t id) { return lease.writer < id; });
  if (found == list->end() || found->writer != writer) return std::nullopt;
  return milliseconds(found->lease_ms);
}

// Returns whether the lease is one of `scene`, and not of a deleted scene that had its address.
bool belongs_to(const LeaseKeeper::Lease& lease, const ScenePtr& scene) {
  return !lease.scene.owner_before(scene) && !scene.owner_before(lease.scene);
}

// Returns the time at which the writer has been silent for `length`. A writer whose batch is not done at `now` cannot
// be silent before the whole length has passed.
LifetimeKeeper::Time due_time(const LeaseKeeper::Lease& lease, milliseconds length, LifetimeKeeper::Time now) {
  const std::optional<uint64_t> since = lease.batches.idle_since();
  return (since ? LifetimeKeeper::Time(nanoseconds(*since)) : now) + length;
}

}  // namespace

void LeaseKeeper::watch(const ScenePtr& scene) {
  const Scene::LeaseList list = scene->leases();
  const MutexLock lock(mutex_);
  for (const locus::Lease& lease : *list)
    find_or_add_locked(scene, lease.writer, lease.lease_ms)->has_begun.store(true);
}

void LeaseKeeper::forget(const Scene& scene) {
  const MutexLock lock(mutex_);
  const auto found = scenes_.find(&scene);
  if (found == scenes_.end()) return;
  for (const auto& [writer, lease] : found->second) keeper_.remove(lease->task);
  leases_.fetch_sub(found->second.size());
  scenes_.erase(found);
}

LeaseKeeper::Batch LeaseKeeper::find_or_add(const ScenePtr& scene, uint64_t writer, uint32_t lease_ms) {
  const MutexLock lock(mutex_);
  Batch lease = find_or_add_locked(scene, writer, lease_ms);
  if (lease != nullptr) lease->batches.begin();
  return lease;
}

LeaseKeeper::Batch LeaseKeeper::find_or_add_locked(const ScenePtr& scene, uint64_t writer, uint32_t lease_ms) {
  if (const auto writers = scenes_.find(scene.get()); writers != scenes_.end()) {
    const auto found = writers->second.find(writer);
    if (found != writers->second.end() && belongs_to(*found->second, scene)) return found->second;
  }
  if (lease_ms == 0) return nullptr;
  const Time now = keeper_.now();
  auto lease = std::make_shared<Lease>();
  lease->scene = scene;
  lease->address = scene.get();
  lease->writer = writer;
  lease->batches.touch(nanoseconds_of(now));
  lease->task = keeper_.add(now + milliseconds(lease_ms), [this, weak = std::weak_ptr<Lease>(lease)](Time time) {
    const std::shared_ptr<Lease> watched = weak.lock();
    return watched == nullptr ? std::nullopt : check(watched, time);
  });
  Batch& added = scenes_[scene.get()][writer];
  if (added == nullptr)
    leases_.fetch_add(1);
  else
    keeper_.remove(added->task);
  added = lease;
  return lease;
}

void LeaseKeeper::batch_done(const Batch& batch, uint32_t lease_ms) {
  if (batch == nullptr) return;
  const Time now = keeper_.now();
  batch->batches.end(nanoseconds_of(now));
  if (!batch->has_begun.load()) {
    const ScenePtr scene = batch->scene.lock();
    if (scene == nullptr || !length_of(*scene, batch->writer)) {
      if (forget(batch)) return;
    } else {
      batch->has_begun.store(true);
    }
  }
  // The lease may be shorter from this batch on.
  if (lease_ms != 0) keeper_.expedite(batch->task, now + milliseconds(lease_ms));
}

bool LeaseKeeper::forget(const std::shared_ptr<Lease>& lease, SceneState state) {
  const ScenePtr scene = lease->scene.lock();  // released after the lock
  const MutexLock lock(mutex_);
  if (!lease->batches.idle_since()) {
    lease->has_begun.store(false);
    return false;
  }
  // A batch that arrived after the end of the lease may have begun another one, and be done already.
  const bool has_begun = state == SceneState::kOpen && scene != nullptr && length_of(*scene, lease->writer);
  lease->has_begun.store(has_begun);
  if (has_begun) return false;
  keeper_.remove(lease->task);
  const auto writers = scenes_.find(lease->address);
  if (writers == scenes_.end()) return true;
  const auto found = writers->second.find(lease->writer);
  if (found == writers->second.end() || found->second != lease) return true;
  writers->second.erase(found);
  leases_.fetch_sub(1);
  if (writers->second.empty()) scenes_.erase(writers);
  return true;
}

std::optional<LeaseKeeper::Time> LeaseKeeper::check(const std::shared_ptr<Lease>& lease, Time now) {
  const ScenePtr scene = lease->scene.lock();
  if (scene == nullptr) {
    forget(lease);
    return std::nullopt;
  }
  const std::optional<milliseconds> length = length_of(*scene, lease->writer);
  if (!length) return forget(lease) ? std::nullopt : std::optional(now + kRetrySoon);
  const Time due = due_time(*lease, *length, now);
  if (due > now && !planted(PlantedBug::kLeaseTwice)) return due;
  return end(lease, *scene, *length, now);
}

std::optional<LeaseKeeper::Time> LeaseKeeper::end(const std::shared_ptr<Lease>& lease, Scene& scene,
                                                  milliseconds length, Time now) {
  const auto is_due = [&] { return planted(PlantedBug::kLeaseTwice) || due_time(*lease, length, now) <= now; };
  const absl::StatusOr<std::optional<uint64_t>> ended =
      scene.end_lease(lease->writer, is_due, std::chrono::steady_clock::time_point::min());
  if (ended.ok() && !ended->has_value()) return due_time(*lease, length, now);
  if (ended.ok()) {
    ended_.fetch_add(1);
    report_(scene, lease->writer, **ended);
  } else if (absl::IsDeadlineExceeded(ended.status())) {
    scene.revoke_overdue_readers();
    return now + kRetrySoon;
  } else if (!absl::IsNotFound(ended.status())) {
    report_(scene, lease->writer, ended.status());
    return now + kRetryAfter;
  }
  // The lease has ended, or the scene was deleted. A batch that arrived meanwhile may begin another lease.
  if (planted(PlantedBug::kLeaseTwice)) return now + length;
  const SceneState state = ended.ok() ? SceneState::kOpen : SceneState::kClosed;
  return forget(lease, state) ? std::nullopt : std::optional(now + length);
}

}  // namespace locus::server
