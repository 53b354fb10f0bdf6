// Which revisions of a scene are being read, and what that keeps from being freed: so that slow readers cannot make
// memory grow without end while updates stream in. Once they hold more than their budget, the oldest are told to end,
// and the writer waits until they have.
//
// Threads: every member may be called from any thread, judge() from one at a time. Readers and the writer wait for each
// other only for as long as it takes to look at a small map: memory is counted outside the lock.
#ifndef LOCUS_CORE_SCENE_READERS_READER_TRACKER_H_
#define LOCUS_CORE_SCENE_READERS_READER_TRACKER_H_

#include <atomic>
#include <chrono>
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

// A reader's hold on a snapshot: on the ledger until it is dropped.
class SnapshotPin {
 public:
  SnapshotPin(std::shared_ptr<ReaderTracker> tracker, SnapshotPtr snapshot);
  SnapshotPin(SnapshotPin&& other) noexcept = default;
  SnapshotPin& operator=(SnapshotPin&&) = delete;
  ~SnapshotPin();

  const SceneSnapshot& operator*() const { return *snapshot_; }
  const SceneSnapshot* operator->() const { return snapshot_.get(); }
  const SnapshotPtr& snapshot() const { return snapshot_; }

  // OK, or RESOURCE_EXHAUSTED naming the limit pinned_bytes once the reader is to end. Cheap: to be asked all the time.
  absl::Status status() const;

  // For readers that wait for others, such as for a client that takes what they send: `cut` is called, under the
  // ledger's lock and at most once, where the reader was told to end and has not. At most one a pin.
  void on_revoke(std::function<void()> revocation);

 private:
  friend class ReaderTracker;
  struct Pinned {
    std::weak_ptr<const SceneSnapshot> snapshot;
    uint64_t replaced_bytes;  // as the snapshot says
    uint32_t pins = 0;
    std::atomic<bool> revoked{false};
    // Written before `ended`: what made it so.
    uint64_t budget = 0;
    uint64_t held = 0;
  };
  using Entry = std::map<uint64_t, Pinned>::iterator;
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

  // `budget` in bytes; 0 = the larger of limits::kPinnedBytes and limits::kPinnedShare times what the scene takes.
  explicit ReaderTracker(uint64_t budget) : fixed_(budget), budget_(budget_for(0)) {}

  // The writer's, after `latest` was published. Usually O(1); where what was replaced since the oldest pin could pass
  // the budget, O(what the pinned revisions do not share), and where they do pass it the oldest pins are told to end,
  // as many as it takes. `latest` and what is pinned belong to one scene.
  void enforce_budget(const SceneSnapshot& latest) LOCUS_EXCLUDES(mutex_);

  // Whether a pin that was told to end has not.
  bool over_budget() const LOCUS_EXCLUDES(mutex_);
  // Waits until over() is false or close() was called; false when `until` comes first.
  bool wait_until_returned(Time until) const LOCUS_EXCLUDES(mutex_);
  // As of the last count.
  uint64_t budget() const LOCUS_EXCLUDES(mutex_);
  // Cuts those that were told to end and still are there.
  void revoke_overdue() LOCUS_EXCLUDES(mutex_);
  // Nobody needs to wait any more.
  void close() LOCUS_EXCLUDES(mutex_);

  struct Use {
    uint64_t held = 0;    // bytes that would be free if nobody read
    uint64_t budget = 0;  // the most they may come to
  };
  // `latest_bytes` as bytes_of(latest). O(what the pinned revisions do not share).
  Use use(const SceneSnapshot& latest, uint64_t latest_bytes) const LOCUS_EXCLUDES(mutex_);

 private:
  friend class SnapshotPin;
  // Bytes of a pinned revision that neither the next pinned one nor the latest shares.
  struct Holding {
    SnapshotPtr snapshot;
    uint64_t bytes = 0;
  };

  uint64_t budget_for(uint64_t scene_bytes) const;
  SnapshotPin::Entry add(const SnapshotPtr& snapshot) LOCUS_EXCLUDES(mutex_);
  void remove(SnapshotPin::Entry entry, const SnapshotPin::Revocation* revocation) LOCUS_EXCLUDES(mutex_);
  void add_revocation(std::shared_ptr<SnapshotPin::Revocation> revocation) LOCUS_EXCLUDES(mutex_);
  // Whether pins may hold more than the budget, by what was replaced.
  bool may_exceed(const SceneSnapshot& latest) const LOCUS_REQUIRES(mutex_);
  // Before `latest`, oldest first.
  std::vector<Holding> pinned_before(const SceneSnapshot& latest) const LOCUS_REQUIRES(mutex_);
  static uint64_t count(std::vector<Holding>& pinned, const SceneSnapshot& latest);
  void end(const SceneSnapshot& snapshot, uint64_t held) LOCUS_REQUIRES(mutex_);

  const uint64_t fixed_;
  mutable Mutex mutex_;
  mutable ConditionVariable returned_;
  std::map<uint64_t, SnapshotPin::Pinned> pinned_ LOCUS_GUARDED_BY(mutex_);  // by revision
  std::list<std::shared_ptr<SnapshotPin::Revocation>> revocations_ LOCUS_GUARDED_BY(mutex_);
  uint32_t revoked_ LOCUS_GUARDED_BY(mutex_) = 0;  // of pinned_, told to end
  bool closed_ LOCUS_GUARDED_BY(mutex_) = false;
  // The last count: what pins held that were not told to end, when so much had been replaced, under which budget.
  uint64_t counted_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t counted_at_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t budget_ LOCUS_GUARDED_BY(mutex_);
  // Of the latest revision that was judged; and what pins added since the last count held from before it.
  uint64_t enforced_at_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t late_bytes_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_READERS_READER_TRACKER_H_
