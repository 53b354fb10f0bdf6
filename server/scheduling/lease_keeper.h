// Ends the leases of writers that are silent (core/scene/objects/leases.h): when no batch of a writer has arrived for
// the lease's time, its objects are removed by Scene::end_lease(). Which writers have a lease, and of what time, is
// known from Scene::leases(); this class knows when their batches arrived.
//
// A batch counts from its arrival until it is done, so that a lease does not end while a batch of its writer waits. If
// it is sent as several messages, each message counts when it arrives: see renew(). The decision is made again under
// the lock of the scene's writer, right before the lease ends: a batch that has arrived by then keeps the lease. So a
// lease ends at most once for each silence of its writer.
//
// Threads: every member may be called from any thread. A batch of a writer without a number, and any batch while there
// are no leases, takes no lock. The lock of this class is held only briefly, and no other lock but the keeper's is
// taken while it is held. Invariants: each lease has one task; there are at most limits::kMaxLeases leases of a scene
// that its list of leases contains, and at most one more for each batch that has not been done.
#ifndef LOCUS_SERVER_SCHEDULING_LEASE_KEEPER_H_
#define LOCUS_SERVER_SCHEDULING_LEASE_KEEPER_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/base/mutex.h"
#include "core/scene/registry.h"
#include "server/scheduling/lifetime_keeper.h"

namespace locus::server {

class LeaseKeeper {
 public:
  // Function that is called on the keeper's thread after a lease ended, with the number of removed objects, or with the
  // error if it could not be ended; then this is tried again after kRetryAfter.
  using Report = std::function<void(const Scene& scene, uint64_t writer, const absl::StatusOr<uint64_t>& removed)>;
  static constexpr std::chrono::seconds kRetryAfter{1};
  // Time until the next attempt if the readers of the scene hold too much memory.
  static constexpr std::chrono::milliseconds kRetrySoon{20};

  // The lease of one writer. It is added when the batch arrives that begins it.
  struct Lease {
    std::weak_ptr<Scene> scene;
    const Scene* address = nullptr;  // of the scene, which may have been destroyed
    uint64_t writer = 0;
    LifetimeKeeper::TaskId task = 0;
    SceneUses batches;                   // batches of the writer that have arrived
    std::atomic<bool> has_begun{false};  // Scene::leases() contained the lease
  };
  // A batch of a writer with a lease, from its arrival until it is done. Null for other batches.
  using Batch = std::shared_ptr<Lease>;

  // `keeper` must outlive the calls of this object's tasks, which end with the keeper's thread.
  LeaseKeeper(LifetimeKeeper& keeper, Report report) : keeper_(keeper), report_(std::move(report)) {}

  // Begins the time of all leases of a scene that was restored.
  void watch(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_);
  // Forgets the leases of a scene that was deleted.
  void forget(const Scene& scene) LOCUS_EXCLUDES(mutex_);

  // Records that a batch has arrived. `writer` and `lease_ms` are those of the batch. Call before the batch is posted.
  Batch batch_arrived(const ScenePtr& scene, uint64_t writer, uint32_t lease_ms) LOCUS_EXCLUDES(mutex_) {
    if (writer == 0 || (lease_ms == 0 && leases_.load(std::memory_order_relaxed) == 0)) return nullptr;
    return find_or_add(scene, writer, lease_ms);
  }
  // Records that a batch is done: applied, or refused. `lease_ms` is that of the batch.
  void batch_done(const Batch& batch, uint32_t lease_ms) LOCUS_EXCLUDES(mutex_);
  // Renews the lease of a writer that has sent a part of a batch. Does nothing if it has no lease, or `writer` is 0.
  void renew(const ScenePtr& scene, uint64_t writer) LOCUS_EXCLUDES(mutex_) {
    batch_done(batch_arrived(scene, writer, 0), 0);
  }

  // Returns the number of leases, and the number of leases ended so far.
  size_t leases() const { return leases_.load(); }
  uint64_t ended() const { return ended_.load(); }

 private:
  using Time = LifetimeKeeper::Time;
  using Writers = absl::flat_hash_map<uint64_t, std::shared_ptr<Lease>>;

  Batch find_or_add(const ScenePtr& scene, uint64_t writer, uint32_t lease_ms) LOCUS_EXCLUDES(mutex_);
  // Returns the lease of the writer. If it is not known, adds it if `lease_ms` is not 0, else returns null.
  Batch find_or_add_locked(const ScenePtr& scene, uint64_t writer, uint32_t lease_ms) LOCUS_REQUIRES(mutex_);
  // Ends the lease if its writer is silent. Returns the time of the next check.
  std::optional<Time> check(const std::shared_ptr<Lease>& lease, Time now) LOCUS_EXCLUDES(mutex_);
  // Ends the lease, whose length is `length`, unless a batch of the writer arrives before. Returns the time of the next
  // check.
  std::optional<Time> end(const std::shared_ptr<Lease>& lease, Scene& scene, std::chrono::milliseconds length, Time now)
      LOCUS_EXCLUDES(mutex_);
  enum class SceneState : uint8_t { kOpen, kClosed };
  // Forgets a lease that the scene does not have. If an open scene has it, or if a batch of its writer has arrived and
  // is not done, whose end then decides, does nothing and returns false.
  bool forget(const std::shared_ptr<Lease>& lease, SceneState state = SceneState::kOpen) LOCUS_EXCLUDES(mutex_);

  LifetimeKeeper& keeper_;
  const Report report_;
  std::atomic<size_t> leases_{0};  // changed under mutex_
  std::atomic<uint64_t> ended_{0};
  Mutex mutex_;
  // By address. A later scene may have the address of a deleted one: see belongs_to().
  absl::flat_hash_map<const Scene*, Writers> scenes_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_LEASE_KEEPER_H_
