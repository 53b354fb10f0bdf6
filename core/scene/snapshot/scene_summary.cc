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
  snapshot.objects.for_each(
      [&summary](const Object& object) { summary.bounds = merge(summary.bounds, bounds_of(object.shape)); });
  return summary;
}

}  // namespace locus
