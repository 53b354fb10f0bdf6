// Tracks the revisions of a scene that readers have pinned, and the memory that cannot be freed because of the pins. If
// pinned revisions hold more memory than the budget, the pins of the oldest revisions are revoked, and the writer waits
// until the revoked pins are released. Therefore slow readers cannot make memory grow without limit while updates
// arrive.
//
// Threads: every member may be called from any thread, but enforce_budget() only from one thread at a time. Readers and
// the writer block each other only while one of them accesses a small map: memory is counted outside the lock.
// Invariants: each entry of pinned_ has at least one pin; revoked_ is the number of revoked entries; a revoked entry
// stays revoked.
#ifndef LOCUS_CORE_SCENE_READERS_READER_TRACKER_H_
#define LOCUS_CORE_SCENE_READERS_READER_TRACKER_H_

#include <atomic>
#include <chrono>
#include <compare>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/limits.h"
#include "core/base/mutex.h"
#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

class ReaderTracker;

// Reference of a reader to a snapshot. The pin keeps the snapshot in memory and is registered with the tracker until
// the pin is destroyed. One thread at a time.
class SnapshotPin {
 public:
  SnapshotPin(std::shared_ptr<ReaderTracker> tracker, SnapshotPtr snapshot);
  SnapshotPin(SnapshotPin&& other) noexcept = default;
  SnapshotPin& operator=(SnapshotPin&&) = delete;
  ~SnapshotPin();

  const SceneSnapshot& operator*() const { return *snapshot_; }
  const SceneSnapshot* operator->() const { return snapshot_.get(); }
  const SnapshotPtr& snapshot() const { return snapshot_; }

  // Returns OK, or RESOURCE_EXHAUSTED naming the limit pinned_bytes once the pin is revoked. Cheap: readers poll it.
  absl::Status status() const;

  // Registers a callback for readers that may block, for example on a slow client. revoke_overdue() calls the callback
  // under the tracker's lock, at most once, if the pin is revoked but not released. A pin has at most one callback.
  void on_revoke(std::function<void()> revocation);

 private:
  friend class ReaderTracker;
  // Age of a snapshot; an earlier snapshot of a scene has a lesser age. The revision alone does not suffice, because
  // Scene::trim_history() replaces the snapshot of a revision by one with more replaced bytes.
  struct Age {
    uint64_t revision, replaced_bytes;

    static Age of(const SceneSnapshot& snapshot) { return {snapshot.revision, snapshot.replaced_bytes}; }
    friend auto operator<=>(const Age&, const Age&) = default;
  };
  struct Pinned {
    std::weak_ptr<const SceneSnapshot> snapshot;
    uint32_t pins = 0;
    std::atomic<bool> revoked{false};
    // Budget and held bytes at the time of the revocation. Both are written before `revoked` is set, and so are safe to
    // read once `revoked` is true.
    uint64_t budget = 0;
    uint64_t held = 0;
  };
  using Entry = std::map<Age, Pinned>::iterator;
  using Revocation = std::pair<Pinned*, std::function<void()>>;

  std::shared_ptr<ReaderTracker> tracker_;
  SnapshotPtr snapshot_;
  Entry entry_;
  std::shared_ptr<Revocation> revocation_;
};

class ReaderTracker {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr Time kNever = Time::max();

  // `budget` is the memory budget of readers in bytes. 0 means the larger of limits::kPinnedBytes and
  // limits::kPinnedShare times the memory of the scene.
  explicit ReaderTracker(uint64_t budget) : fixed_(budget), budget_(budget_for(0)) {}

  // Revokes the oldest pins until the memory held by the other pins fits the budget. The writer calls enforce_budget()
  // after publishing `latest`. O(1) if may_exceed() returns false, as it usually does; otherwise O(memory that the
  // pinned revisions do not share). `latest` and all pinned snapshots belong to one scene.
  void enforce_budget(const SceneSnapshot& latest) LOCUS_EXCLUDES(mutex_);

  // Returns true while a revoked pin is not released, unless the tracker is closed.
  bool over_budget() const LOCUS_EXCLUDES(mutex_);
  // Waits until over_budget() is false and returns true. Returns false if over_budget() is still true at `until`.
  bool wait_until_returned(Time until) const LOCUS_EXCLUDES(mutex_);
  // Returns the budget in bytes that the last count of held memory used.
  uint64_t budget() const LOCUS_EXCLUDES(mutex_);
  // Calls the on_revoke() callbacks of pins that are revoked but not released, each at most once.
  void revoke_overdue() LOCUS_EXCLUDES(mutex_);
  // Revokes the oldest pins until the other pins hold at most `bytes`, regardless of the budget. Called when memory is
  // short. Returns the number of bytes that become free when the readers of the pins revoked by this call end.
  uint64_t revoke_beyond(const SceneSnapshot& latest, uint64_t bytes) LOCUS_EXCLUDES(mutex_);
  // Closes the tracker: running and later calls of wait_until_returned() return true immediately.
  void close() LOCUS_EXCLUDES(mutex_);

  struct Use {
    uint64_t held = 0;    // bytes held only by pinned revisions before the latest revision
    uint64_t budget = 0;  // maximum of `held`, in bytes
  };
  // Returns the memory held by pins. `latest_bytes` is bytes_of(latest). O(memory that the pinned revisions do not
  // share).
  Use use(const SceneSnapshot& latest, uint64_t latest_bytes) const LOCUS_EXCLUDES(mutex_);

 private:
  friend class SnapshotPin;
  // Pinned snapshot. `bytes` is the memory that it does not share with the next later pinned snapshot or, if there is
  // none, with the latest snapshot.
  struct Holding {
    SnapshotPtr snapshot;
    uint64_t bytes = 0;
  };

  // Checks the invariants, without counting the revoked entries of pinned_. O(1).
  void check_invariants() const LOCUS_REQUIRES(mutex_);
  uint64_t budget_for(uint64_t scene_bytes) const;
  SnapshotPin::Entry add(const SnapshotPtr& snapshot) LOCUS_EXCLUDES(mutex_);
  void remove(SnapshotPin::Entry entry, const SnapshotPin::Revocation* revocation) LOCUS_EXCLUDES(mutex_);
  void add_revocation(std::shared_ptr<SnapshotPin::Revocation> revocation) LOCUS_EXCLUDES(mutex_);
  // Returns true if pinned revisions may hold more memory than the budget. The result is estimated from the number of
  // bytes that updates have replaced since the oldest pinned revision and since the last count of held memory.
  bool may_exceed(const SceneSnapshot& latest) const LOCUS_REQUIRES(mutex_);
  // Returns the pinned snapshots before `latest`, oldest first.
  std::vector<Holding> pinned_before(const SceneSnapshot& latest) const LOCUS_REQUIRES(mutex_);
  // Sets Holding::bytes of each entry of `pinned`, oldest first, and returns the sum.
  static uint64_t count(std::vector<Holding>& pinned, const SceneSnapshot& latest);
  // Revokes the pins of a snapshot. Stores two numbers for the error that readers get: `held`, the bytes that all
  // pinned snapshots hold, and `budget`, which `held` exceeds. Returns false if the snapshot is no longer pinned, or if
  // its pins are revoked already.
  bool revoke(const SceneSnapshot& snapshot, uint64_t held, uint64_t budget) LOCUS_REQUIRES(mutex_);

  const uint64_t fixed_;  // budget passed to the constructor; 0: derived from the memory of the scene
  mutable Mutex mutex_;
  mutable ConditionVariable returned_;
  std::map<SnapshotPin::Age, SnapshotPin::Pinned> pinned_ LOCUS_GUARDED_BY(mutex_);
  std::list<std::shared_ptr<SnapshotPin::Revocation>> revocations_ LOCUS_GUARDED_BY(mutex_);
  uint32_t revoked_ LOCUS_GUARDED_BY(mutex_) = 0;  // number of revoked entries of pinned_
  bool closed_ LOCUS_GUARDED_BY(mutex_) = false;
  // Results of the last count of held memory: counted_ is the number of bytes held by pins that are not revoked,
  // counted_at_ is SceneSnapshot::replaced_bytes of the latest snapshot at that time, and budget_ is the budget in
  // bytes.
  uint64_t counted_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t counted_at_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t budget_ LOCUS_GUARDED_BY(mutex_);
  // enforced_at_ is SceneSnapshot::replaced_bytes of the last snapshot passed to enforce_budget(). late_bytes_ is a
  // sum over the revisions that were pinned after the last count and were already outdated when they were pinned. The
  // term of such a revision is enforced_at_ at the time of its pin, minus SceneSnapshot::replaced_bytes of the
  // revision.
  uint64_t enforced_at_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t late_bytes_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_READERS_READER_TRACKER_H_
