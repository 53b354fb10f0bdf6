#include "core/scene/snapshot/scene_summary.h"

#include <algorithm>
#include <set>

namespace locus {

SceneSummary summarize(const SceneSnapshot& snapshot) {
  SceneSummary summary;
  summary.epoch = snapshot.epoch;
  summary.revision = snapshot.revision;
  summary.tick = snapshot.tick;
  summary.oldest_tick = snapshot.oldest_tick();
  summary.objects = snapshot.objects.size();
  summary.instances = snapshot.statics->size();
  summary.triangles = snapshot.statics->triangle_count();
  summary.bounds = snapshot.statics->tree().bounds();
  Work work;
  const auto object_bounds = [](const GridRef& object) { return bounds_of(object, shape_of(object)); };
  summary.bounds = merge(summary.bounds, snapshot.objects.grid().bounds(object_bounds, work));
  summary.work = work.cells + work.tests;
  return summary;
}

SceneStructures structures_of(const SceneSnapshot& snapshot) {
  const StaticSet& statics = *snapshot.statics;
  SceneStructures sizes;
  uint32_t deepest = 0;
  std::set<const TriangleBvh*> trees;  // names of equal content share a tree
  for (const StaticMesh* mesh : statics.meshes()) {
    if (!trees.insert(&mesh->tree()).second) continue;
    deepest = std::max(deepest, mesh->tree().depth());
    sizes.static_nodes += mesh->tree().node_count();
  }
  sizes.static_levels = statics.tree().depth() + deepest;
  sizes.static_nodes += statics.tree().node_count();
  sizes.static_bytes = statics.bytes() + statics.mesh_bytes();
  const GridSnapshot& grid = snapshot.objects.grid();
  sizes.object_levels = static_cast<uint32_t>(grid.level_count());
  sizes.object_bricks = grid.brick_count();
  sizes.object_bytes = snapshot.objects.bytes();
  sizes.cell_size = grid.cell_size();
  return sizes;
}

}  // namespace locus
