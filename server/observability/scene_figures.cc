#include "server/observability/scene_figures.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace locus::server {
namespace {

void add_up(const SceneFigures& scene, SceneFigures& sum) {
  sum.revision += scene.revision;
  sum.objects += scene.objects;
  sum.instances += scene.instances;
  sum.triangles += scene.triangles;
  sum.memory_bytes += scene.memory_bytes;
  sum.mesh_bytes += scene.mesh_bytes;
  sum.recent_bytes += scene.recent_bytes;
  sum.history_bytes += scene.history_bytes;
  sum.history_ticks += scene.history_ticks;
  sum.history_asked_ticks += scene.history_asked_ticks;
  sum.history_forgotten_ticks += scene.history_forgotten_ticks;
  sum.history_short += scene.history_short;
  sum.pinned_bytes += scene.pinned_bytes;
  sum.log_bytes += scene.log_bytes;
  sum.pending_changes += scene.pending_changes;
  sum.leading += scene.leading;
}

struct Figure {
  const char* name;
  const char* help;
  uint64_t SceneFigures::*value;
};

constexpr Figure kFigures[] = {
    {"locus_scene_revision", "The scene's revision, one more for each change that was published.",
     &SceneFigures::revision},
    {"locus_scene_objects", "Objects in the scene.", &SceneFigures::objects},
    {"locus_scene_instances", "Placed meshes in the scene.", &SceneFigures::instances},
    {"locus_scene_triangles", "Triangles of the scene's placed meshes.", &SceneFigures::triangles},
    {"locus_scene_memory_bytes", "Memory of the scene's latest revision without meshes, in bytes.",
     &SceneFigures::memory_bytes},
    {"locus_scene_mesh_bytes", "Memory of the meshes that the scene places and shares with other scenes, in bytes.",
     &SceneFigures::mesh_bytes},
    {"locus_scene_recent_bytes", "Largest possible memory of the recent revisions that the scene retains, in bytes.",
     &SceneFigures::recent_bytes},
    {"locus_scene_history_bytes", "Memory of the scene's history beyond its latest revision, in bytes.",
     &SceneFigures::history_bytes},
    {"locus_scene_history_ticks", "Ticks of the past that queries may ask about.", &SceneFigures::history_ticks},
    {"locus_scene_history_asked_ticks", "Ticks of the past that the scene was created to retain.",
     &SceneFigures::history_asked_ticks},
    {"locus_scene_history_forgotten_ticks",
     "Ticks that the history dropped for lack of memory before they were too old.",
     &SceneFigures::history_forgotten_ticks},
    {"locus_scene_history_short", "1 if the history lacks ticks that did not fit into its memory, otherwise 0.",
     &SceneFigures::history_short},
    {"locus_scene_pinned_bytes", "Memory of older revisions of the scene that are still being read, in bytes.",
     &SceneFigures::pinned_bytes},
    {"locus_scene_log_bytes", "Updates of the scene in the log since its snapshot, in bytes.",
     &SceneFigures::log_bytes},
    {"locus_scene_pending_changes", "Changes of the scene's instances that are being built or wait.",
     &SceneFigures::pending_changes},
};

constexpr Figure kLeading = {"locus_scene_leading", "1 if this member of the cluster leads the scene, otherwise 0.",
                             &SceneFigures::leading};

void add_figure(const Figure& figure, const std::vector<SceneFigures>& scenes, MetricPage& page) {
  page.begin(figure.name, figure.help, MetricKind::kGauge);
  for (const SceneFigures& scene : scenes) page.add({{"scene", scene.name}}, static_cast<double>(scene.*figure.value));
}

}  // namespace

std::vector<SceneFigures> SceneLabels::label(const std::vector<SceneFigures>& scenes) {
  LOCUS_DCHECK(std::is_sorted(scenes.begin(), scenes.end(),
                              [](const SceneFigures& a, const SceneFigures& b) { return a.name < b.name; }));
  std::set<std::string> present;
  for (const SceneFigures& scene : scenes)
    if (labelled_.contains(scene.name)) present.insert(scene.name);
  labelled_ = std::move(present);
  for (const SceneFigures& scene : scenes)
    if (labelled_.size() < max_) labelled_.insert(scene.name);
  std::vector<SceneFigures> shown;
  SceneFigures other;
  for (const SceneFigures& scene : scenes) {
    if (labelled_.contains(scene.name)) {
      shown.push_back(scene);
    } else {
      other.name = kOther;
      add_up(scene, other);
    }
  }
  if (!other.name.empty()) shown.push_back(other);
  LOCUS_DCHECK_LE(shown.size(), max_ + 1);  // one more for the sum over the scenes without a label
  LOCUS_DCHECK_CALL(check_invariants());
  return shown;
}

void SceneLabels::check_invariants() const {
  LOCUS_DCHECK_LE(labelled_.size(), max_);
  LOCUS_DCHECK(!labelled_.contains(kOther));
}

void add_scene_figures(const std::vector<SceneFigures>& scenes, MetricPage& page) {
  for (const Figure& figure : kFigures) add_figure(figure, scenes, page);
}

void add_led_scenes(const std::vector<SceneFigures>& scenes, MetricPage& page) { add_figure(kLeading, scenes, page); }

}  // namespace locus::server
