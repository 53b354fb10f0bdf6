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
  uint64_t epoch = 0;     // names one unbroken history of revisions
  uint64_t revision = 0;  // +1 for each applied batch or static change
  uint64_t tick = 0;      // the caller's time step
  Winding winding = Winding::kCounterClockwise;
  std::shared_ptr<const StaticSet> statics;
  ObjectSet objects;
  HistoryPtr history;        // null if no history is kept
  Displacement since_close;  // displacement from the last record to this revision
  // Total memory replaced by the revisions up to this one, without lookup tables. Includes memory that was allocated
  // and replaced between two revisions, and memory that the history still holds. Never decreases.
  uint64_t replaced_bytes = 0;
  PastLimit past_limit = PastLimit::kOff;  // reason why no tick before oldest_tick() is kept

  // Returns the oldest tick that queries may ask about.
  uint64_t oldest_tick() const { return history == nullptr ? tick : history->records.front()->tick; }
};

using SnapshotPtr = std::shared_ptr<const SceneSnapshot>;

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SNAPSHOT_H_
