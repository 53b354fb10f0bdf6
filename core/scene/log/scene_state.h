// All that a scene is at one moment, so that it can be put down in chunks and made again: what readers see, and what
// its writer knows beside that. The past is not in it.
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

// A scene held still: what is written. Cheap to hold, while the scene goes on.
struct FrozenScene {
  SnapshotPtr snapshot;
  WriterTable writers;
  bool has_past = false;   // as SceneWriter::has_past()
  uint64_t sequence = 0;   // of the last record whose effect is in it ...
  uint64_t log_bytes = 0;  // ... and all that was logged so far: for Scene::snapshot_written()
};

// A scene read again: what a SceneWriter is made from.
struct SceneState {
  uint64_t epoch = 0;
  uint64_t revision = 0;
  uint64_t tick = 0;
  bool has_past = false;
  WriterTable writers;
  std::shared_ptr<const StaticSet> statics;
  double cell_size = 0;                      // of the grid
  std::vector<std::vector<Object>> objects;  // in pieces, as they were read
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_SCENE_STATE_H_
