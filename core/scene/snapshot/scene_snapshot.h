// Everything a scene is at one revision. Immutable, shared: whoever holds it sees that revision for as long as it is
// held, whatever the writer does meanwhile.
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
  HistoryPtr history;        // null where nothing of the past is kept
  Displacement since_close;  // from the last record to here
  // Of what revisions up to this one replaced, but for the maps that find it. What was born and replaced between two
  // revisions, or is kept in the past, is in it, so that neither holds all of it alone.
  uint64_t replaced_bytes = 0;
  PastLimit past_limit = PastLimit::kOff;  // why nothing before oldest_tick() is kept

  // The oldest moment that can be asked about.
  uint64_t oldest_tick() const { return history == nullptr ? tick : history->records.front()->tick; }
};

using SnapshotPtr = std::shared_ptr<const SceneSnapshot>;

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SNAPSHOT_H_
