#include "server/storage/integrity/scene_table.h"

#include <algorithm>

#include "core/base/check.h"
#include "server/storage/rows/refusals.h"

namespace locus::server {
void SceneTable::add(SceneLogStatePtr scene) {
  LOCUS_DCHECK(scene != nullptr);
  MutexLock lock(mutex_);
  LOCUS_DCHECK_CALL(check_invariants(*scene));
  scenes_[scene->key] = std::move(scene);
}

absl::StatusOr<SceneLogStatePtr> SceneTable::find(SceneKey scene) const {
  SceneLogStatePtr found = find_any(scene);
  if (found == nullptr) return scene_not_stored(scene);
  if (!found->damage.ok()) return found->damage;
  return found;
}

SceneLogStatePtr SceneTable::find_any(SceneKey scene) const {
  MutexLock lock(mutex_);
  const auto found = scenes_.find(scene);
  return found == scenes_.end() ? nullptr : found->second;
}

bool SceneTable::has_name(absl::string_view name) const {
  MutexLock lock(mutex_);
  return std::any_of(scenes_.begin(), scenes_.end(), [&](const auto& scene) { return scene.second->name == name; });
}

size_t SceneTable::size() const {
  MutexLock lock(mutex_);
  return scenes_.size();
}

uint64_t SceneTable::last_of(const SceneLogState& scene) const {
  MutexLock lock(mutex_);
  return scene.written.sequence;
}

absl::StatusOr<SceneTable::Start> SceneTable::begin_append(SceneLogState& scene, uint64_t epoch,
                                                           uint64_t database_sequence) {
  MutexLock lock(mutex_);
  if (scene.deleted) return scene_not_stored(scene.key);
  if (scene.epoch != epoch) {
    return refuse_epoch(scene.name, scene.epoch, epoch);
  }
  LOCUS_DCHECK(!scene.append_began_at.has_value());
  scene.append_began_at = database_sequence;
  return Start{scene.written, scene.possibly_written_end};
}

void SceneTable::end_append(SceneLogState& scene, Position written, bool synced) {
  MutexLock lock(mutex_);
  LOCUS_DCHECK(scene.append_began_at.has_value());
  LOCUS_DCHECK_LT(scene.written.sequence, written.sequence);
  scene.append_began_at.reset();
  scene.written = written;
  scene.possibly_written_end = 0;
  if (synced) scene.synced = written;
  LOCUS_DCHECK_CALL(check_invariants(scene));
}

void SceneTable::fail_append(SceneLogState& scene, uint64_t last) {
  MutexLock lock(mutex_);
  LOCUS_DCHECK(scene.append_began_at.has_value());
  LOCUS_DCHECK_LT(scene.written.sequence, last);
  scene.append_began_at.reset();
  scene.possibly_written_end = std::max(scene.possibly_written_end, last);
}

std::vector<std::pair<SceneLogStatePtr, Position>> SceneTable::written() const {
  MutexLock lock(mutex_);
  std::vector<std::pair<SceneLogStatePtr, Position>> positions;
  positions.reserve(scenes_.size());
  for (const auto& [key, scene] : scenes_) positions.emplace_back(scene, scene->written);
  return positions;
}

void SceneTable::mark_synced(const std::vector<std::pair<SceneLogStatePtr, Position>>& positions) {
  MutexLock lock(mutex_);
  for (const auto& [scene, position] : positions) {
    if (scene->synced.sequence < position.sequence) scene->synced = position;
    LOCUS_DCHECK_CALL(check_invariants(*scene));
  }
}

void SceneTable::set_catalogue(const CatalogueRow& totals) {
  MutexLock lock(mutex_);
  totals_ = totals;
}

void SceneTable::set_row(SceneLogState& scene, const SceneRow& row, uint64_t row_checksum, const CatalogueRow& totals) {
  MutexLock lock(mutex_);
  LOCUS_DCHECK_EQ(scene.key, row.key);
  if (scene.epoch != row.epoch) scene.copied = false;
  scene.epoch = row.epoch;
  scene.row_checksum = row_checksum;
  // The snapshot is synced and contains all records up to snapshot_sequence.
  if (scene.synced.sequence < row.snapshot_sequence) scene.synced = {row.snapshot_sequence, row.running_checksum};
  LOCUS_DCHECK_CALL(check_invariants(scene));
  totals_ = totals;
}

void SceneTable::remove(SceneKey scene, const CatalogueRow& totals) {
  MutexLock lock(mutex_);
  const auto found = scenes_.find(scene);
  if (found != scenes_.end()) {
    found->second->deleted = true;
    scenes_.erase(found);
  }
  totals_ = totals;
}

void SceneTable::fill_marker(uint64_t database_sequence, DurableMarker& durable_marker) const {
  MutexLock lock(mutex_);
  durable_marker.catalogue = totals_.generation;
  durable_marker.next_scene = totals_.next_scene;
  durable_marker.mesh_sum = totals_.mesh_sum;
  durable_marker.scene_markers.clear();
  bool all_synced = true;
  for (const auto& [key, scene] : scenes_) {
    // The marker must not cover the writes of an append in progress, whose RocksDB sequence numbers follow
    // append_began_at.
    if (scene->append_began_at) database_sequence = std::min(database_sequence, *scene->append_began_at);
    all_synced = all_synced && scene->synced.sequence == scene->written.sequence;
    SceneMarker& scene_marker = durable_marker.scene_markers.emplace_back();
    scene_marker.scene = key;
    scene_marker.name = scene->name;
    scene_marker.sequence = scene->synced.sequence;
    scene_marker.running_checksum = scene->synced.running_checksum;
    scene_marker.row_checksum = scene->row_checksum;
    scene_marker.copied = scene->copied;
    scene_marker.damage = scene->damage_found;
  }
  if (all_synced) durable_marker.flushed_sequence = database_sequence;
}

void SceneTable::check_invariants(const SceneLogState& scene) const {
  LOCUS_CHECK_LE(scene.synced.sequence, scene.written.sequence);
  if (scene.synced.sequence == scene.written.sequence)
    LOCUS_CHECK_EQ(scene.synced.running_checksum, scene.written.running_checksum);
}

}  // namespace locus::server
