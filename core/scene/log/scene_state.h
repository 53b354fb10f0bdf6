// Complete state of a scene at one revision, to be written to a snapshot in chunks and read again: the part that
// readers see, and the part that only the writer uses. The history is not included. Plain data.
#ifndef LOCUS_CORE_SCENE_LOG_SCENE_STATE_H_
#define LOCUS_CORE_SCENE_LOG_SCENE_STATE_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "core/scene/objects/object.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/writer_table.h"

namespace locus {

// Frozen scene, the input of StateWriter. Cheap to hold while the scene continues.
struct FrozenScene {
  SnapshotPtr snapshot;
  WriterTable writers;
  bool has_past = false;   // SceneWriter::has_past()
  uint64_t sequence = 0;   // sequence number of the last record whose effect is included
  uint64_t log_bytes = 0;  // SceneJournal::total_bytes() at that record
};

// Decoded scene snapshot, the input of SceneWriter::restore().
struct SceneState {
  uint64_t epoch = 0;
  uint64_t revision = 0;
  uint64_t tick = 0;
  bool has_past = false;
  WriterTable writers;
  std::shared_ptr<const StaticSet> statics;
  double cell_size = 0;                      // cell size of the grid
  std::vector<std::vector<Object>> objects;  // one vector for each chunk read
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_SCENE_STATE_H_
