// Metrics of each scene, labelled with the scene's name. The number of labels is bounded, because scrapers keep every
// label they have seen: kMaxLabelledScenes scenes have their own label, and all other scenes are summed under the label
// "_other", which is not a valid name of a scene.
//
// Threads: only one thread at a time may use a SceneLabels.
#ifndef LOCUS_SERVER_OBSERVABILITY_SCENE_FIGURES_H_
#define LOCUS_SERVER_OBSERVABILITY_SCENE_FIGURES_H_

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "server/observability/metric_page.h"

namespace locus::server {

// Figures of one scene, or their sums over several scenes.
struct SceneFigures {
  std::string name;
  uint64_t revision = 0;
  uint64_t objects = 0;
  uint64_t instances = 0;
  uint64_t triangles = 0;
  uint64_t memory_bytes = 0;
  uint64_t mesh_bytes = 0;
  uint64_t recent_bytes = 0;
  uint64_t history_bytes = 0;
  uint64_t history_ticks = 0;
  uint64_t history_asked_ticks = 0;
  uint64_t history_forgotten_ticks = 0;
  uint64_t history_short = 0;  // 1 if the scene has forgotten ticks early, else 0
  uint64_t pinned_bytes = 0;
  uint64_t log_bytes = 0;
  uint64_t pending_changes = 0;
  uint64_t leading = 0;  // 1 if this server is the scene's leader in a cluster, else 0
};

// The set of scenes that have a label. Invariant: at most `max` scenes have a label. A scene keeps its label until the
// scene is deleted, so that its time series continues. A free label is given to the scene whose name sorts first among
// the scenes without a label.
class SceneLabels {
 public:
  static constexpr const char* kOther = "_other";

  explicit SceneLabels(size_t max) : max_(max) {}

  // Updates the labels. Returns the figures of the labelled scenes and then, if there are other scenes, the sum of
  // their figures under the name kOther. `scenes` must be all scenes, each once, sorted by name.
  std::vector<SceneFigures> label(const std::vector<SceneFigures>& scenes);

 private:
  void check_invariants() const;

  const size_t max_;
  std::set<std::string> labelled_;
};

// Adds the figures to the page. `scenes` is a result of SceneLabels::label().
void add_scene_figures(const std::vector<SceneFigures>& scenes, MetricPage& page);

// Adds which of the scenes this server leads. Only for a member of a cluster.
void add_led_scenes(const std::vector<SceneFigures>& scenes, MetricPage& page);

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_SCENE_FIGURES_H_
