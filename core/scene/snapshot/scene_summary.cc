#include "core/scene/snapshot/scene_summary.h"

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
  return summary;
}

}  // namespace locus
