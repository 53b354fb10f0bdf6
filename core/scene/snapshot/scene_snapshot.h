// Complete state of a scene at one revision. Immutable and shared: any thread may read the revision for as long as it
// holds the snapshot, while the writer makes further revisions.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SNAPSHOT_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SNAPSHOT_H_

#include <memory>

#include "core/scene/objects/expiries.h"
#include "core/scene/objects/object_set.h"
#include "core/scene/snapshot/history.h"
#include "core/scene/statics/static_set.h"

namespace locus {

enum class Winding : uint8_t { kCounterClockwise, kClockwise };

struct SceneSnapshot {
  uint64_t epoch = 0;     // identifies one unbroken sequence of revisions
  uint64_t revision = 0;  // one higher after each static change, and after each batch that changes the scene
  uint64_t tick = 0;      // time step of the caller, set by update batches
  Winding winding = Winding::kCounterClockwise;
  std::shared_ptr<const StaticSet> statics;
  ObjectSet objects;
  HistoryPtr history;        // null if the history has no record
  Displacement since_close;  // displacement from the last history record to this revision
  // Total bytes of memory that the revisions up to this one have replaced, not counting the lookup tables of the grid.
  // Includes memory that was allocated and replaced between two revisions, and memory that the history still holds.
  // Never decreases.
  uint64_t replaced_bytes = 0;
  PastLimit past_limit = PastLimit::kOff;       // reason why the history has no ticks before oldest_tick()
  uint64_t forgotten_ticks = 0;                 // see HistoryRecorder::forgotten_ticks()
  std::shared_ptr<const ExpiryTable> expiries;  // null if no object expires

  // Returns the number of ticks until an object of `objects` expires; 0 if it does not expire. O(1).
  uint64_t remaining_ticks(uint32_t handle) const {
    return expiries == nullptr ? 0 : expiries->remaining(handle, tick);
  }
  // Returns the oldest tick at which queries may be evaluated.
  uint64_t oldest_tick() const { return history == nullptr ? tick : history->records.front()->tick; }
};

using SnapshotPtr = std::shared_ptr<const SceneSnapshot>;

// Returns the bytes that `held` holds and `later`, a later revision of the same scene, does not: objects, instances
// and history, but not meshes, which scenes share. The result is exact except for the bytes of the history. These
// bytes may be overestimated if ticks were restarted between the two revisions. They may be underestimated if `later`
// has dropped the last history record of `held`, and `held` is not the first revision after the tick of this record.
// O(size of the difference + instances / kBvhBlockValues).
uint64_t unshared_bytes(const SceneSnapshot& held, const SceneSnapshot& later);

// Returns the bytes of the snapshot without its history and meshes. O(objects).
uint64_t bytes_of(const SceneSnapshot& snapshot);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SNAPSHOT_H_
