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
  uint64_t work = 0;  // number of cells and objects that summarize() has looked at
  // Contains all objects and instances; empty if the scene has neither. Exact but for the cases that
  // GridSnapshot::bounds() names.
  Aabbd bounds;
};

// Returns the summary of a revision. Cost: see GridSnapshot::bounds().
SceneSummary summarize(const SceneSnapshot& snapshot);

// Sizes of the structures of one revision.
struct SceneStructures {
  uint32_t static_levels = 0;  // those of the tree of instances and of the deepest tree of a mesh
  uint64_t static_nodes = 0;   // those of the tree of instances and of the trees of the meshes
  uint64_t static_bytes = 0;   // with the meshes
  uint32_t object_levels = 0;
  uint64_t object_bricks = 0;
  uint64_t object_bytes = 0;
  double cell_size = 0;  // of the base level of the objects' grid
};

// Returns the sizes of the structures of a revision. O(nodes of the tree of instances + meshes).
SceneStructures structures_of(const SceneSnapshot& snapshot);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SCENE_SUMMARY_H_
