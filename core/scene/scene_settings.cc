// Members of Scene that read and change the settings of a scene.
#include <utility>

#include "core/base/status_macros.h"
#include "core/scene/scene.h"
#include "core/scene/spec_codec.h"

namespace locus {

SceneSettings Scene::settings() const {
  const MutexLock lock(mutex_);
  return settings_;
}

absl::StatusOr<SceneSettings> Scene::change_settings(const SettingsChange& change) {
  const MutexLock writer_lock(writer_mutex_);
  RETURN_IF_ERROR(check_open());
  const SceneSettings before = settings();
  SceneSettings next = before;
  if (change.labels) next.labels = *change.labels;
  if (change.cell_size) next.cell_size = *change.cell_size;
  SceneSpec spec = spec_;
  spec.labels = next.labels;
  spec.cell_size = next.cell_size;
  RETURN_IF_ERROR(journal_.set_spec(encode_spec(spec)));
  if (next.cell_size != before.cell_size) writer_.fix_cell_size(next.cell_size);
  const MutexLock lock(mutex_);
  settings_ = next;
  return next;
}

}  // namespace locus
