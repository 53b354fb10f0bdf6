// Sizes and bounds of one revision of a scene. Plain data; any thread.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SUMMARY_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SUMMARY_H_

#include <cstdint>

#include "core/geometry/aabb.h"
#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

struct SceneSummary {
  uint64_t epoch = 0;
  uint64_t revision = 0;
  uint64_t tick = 0;
  uint64_t oldest_tick = 0;
  uint64_t objects = 0;
  uint64_t instances = 0;
  uint64_t triangles = 0;
  // Contains all objects and instances; empty if the scene has neither. Exact but for the cases that
  // GridSnapshot::bounds() names.
  Aabbd bounds;
};

// Returns the summary of a revision. Cost: see GridSnapshot::bounds().
SceneSummary summarize(const SceneSnapshot& snapshot);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SUMMARY_H_
