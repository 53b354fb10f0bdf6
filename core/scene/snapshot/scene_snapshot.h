// Complete state of a scene at one revision. Immutable and shared: a holder reads that revision from any thread for as
// long as it holds the snapshot, while the writer continues.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SNAPSHOT_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SNAPSHOT_H_

#include <memory>

#include "core/scene/objects/object_set.h"
#include "core/scene/snapshot/history.h"
#include "core/scene/statics/static_set.h"

namespace locus {

enum class Winding : uint8_t { kCounterClockwise, kClockwise };

struct SceneSnapshot {
  uint64_t epoch = 0;     // identifies one unbroken sequence of revisions
  uint64_t revision = 0;  // +1 for each applied batch or static change
  uint64_t tick = 0;      // time step, set by the update batches
  Winding winding = Winding::kCounterClockwise;
  std::shared_ptr<const StaticSet> statics;
  ObjectSet objects;
  HistoryPtr history;        // null if the history has no record
  Displacement since_close;  // displacement from the last history record to this revision
  // Total bytes that the revisions up to this one have replaced, without lookup tables. Includes memory that was
  // allocated and replaced between two revisions, and memory that the history still holds. Never decreases.
  uint64_t replaced_bytes = 0;
  PastLimit past_limit = PastLimit::kOff;  // reason why the history does not reach further back

  // Returns the oldest tick that queries may ask about.
  uint64_t oldest_tick() const { return history == nullptr ? tick : history->records.front()->tick; }
};

using SnapshotPtr = std::shared_ptr<const SceneSnapshot>;

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SNAPSHOT_H_
