// What a scrape finds in each scene, as metrics with a label of the scene's name. The number of labels is bounded,
// since scrapers keep every one they have seen: kMaxLabelledScenes scenes have their own, the others are added up under
// "_other", which is no name that a scene can have.
//
// Threads: SceneLabels is for one thread at a time.
#ifndef LOCUS_SERVER_OBSERVABILITY_SCENE_FIGURES_H_
#define LOCUS_SERVER_OBSERVABILITY_SCENE_FIGURES_H_

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "server/observability/metric_page.h"

namespace locus::server {

struct SceneFigures {
  std::string name;
  uint64_t revision = 0;
  uint64_t objects = 0;
  uint64_t instances = 0;
  uint64_t triangles = 0;
  uint64_t memory_bytes = 0;
  uint64_t history_bytes = 0;
  uint64_t history_ticks = 0;
  uint64_t pinned_bytes = 0;
  uint64_t log_bytes = 0;
  uint64_t pending_changes = 0;
};

// Which scenes have a label. A scene that has one keeps it until it is deleted, so that its series goes on; a free one
// goes to the first in order of names.
class SceneLabels {
 public:
  static constexpr const char* kOther = "_other";

  explicit SceneLabels(size_t most) : most_(most) {}

  // Gives the scenes with labels as they are, then the sum of the others if there are any, named kOther. `scenes` is
  // all there are, each once, in order of names.
  std::vector<SceneFigures> label(const std::vector<SceneFigures>& scenes);

 private:
  const size_t most_;
  std::set<std::string> labelled_;
};

// `scenes` as they came from SceneLabels.
void add_scene_figures(const std::vector<SceneFigures>& scenes, MetricPage& page);

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_SCENE_FIGURES_H_
