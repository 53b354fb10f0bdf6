// Where each scene's log stands: how far it was written and how far it is on the disk, from which HIGH_WATER is made.
//
// Threads: every member may be called from any thread; the lock is held for moments, never while the disk is waited
// for. Invariant: what marks() says was on the disk before it was called.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_SCENE_TABLE_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_SCENE_TABLE_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"
#include "server/storage/integrity/durable_marker.h"
#include "server/storage/rocksdb/rows.h"

namespace locus::server {

// A record by its number, and its checksum.
struct Position {
  uint64_t sequence = 0;
  uint64_t running_checksum = 0;
};

// A scene's place in the log. The table's lock guards all but `writing`.
struct SceneLogState {
  SceneKey key = 0;
  std::string name;
  absl::Status damage;
  std::string damage_found;  // the same for HIGH_WATER
  uint64_t epoch = 0;
  uint64_t row_checksum = 0;
  bool copied = false;
  Position written;
  Position synced;
  // Records up to here failed to be appended, and may turn up: the next append deletes those that it does not replace.
  uint64_t possibly_written_end = 0;
  // An append is at work; RocksDB's number of the last write before it.
  std::optional<uint64_t> begun_at;
  bool deleted = false;
  Mutex writing;  // held while something is written that another write to the scene must not overtake
};

using SceneLogStatePtr = std::shared_ptr<SceneLogState>;

class SceneTable {
 public:
  struct Start {
    Position written;
    uint64_t possibly_written_end = 0;
  };

  void add(SceneLogStatePtr scene) LOCUS_EXCLUDES(mutex_);
  // NOT_FOUND, or the scene's damage.
  absl::StatusOr<SceneLogStatePtr> find(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  // Also a damaged one; null where it is not known.
  SceneLogStatePtr find_any(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  bool has_name(absl::string_view name) const LOCUS_EXCLUDES(mutex_);
  size_t size() const LOCUS_EXCLUDES(mutex_);
  uint64_t last_of(const SceneLogState& scene) const LOCUS_EXCLUDES(mutex_);

  // Between the two `writing` is held. FAILED_PRECONDITION for another epoch, NOT_FOUND for a scene deleted meanwhile.
  absl::StatusOr<Start> begin_append(SceneLogState& scene, uint64_t epoch, uint64_t database_sequence)
      LOCUS_EXCLUDES(mutex_);
  void end_append(SceneLogState& scene, Position written, bool synced) LOCUS_EXCLUDES(mutex_);
  void fail_append(SceneLogState& scene, uint64_t last) LOCUS_EXCLUDES(mutex_);

  // Where all scenes have been written to; after the disk has it, on_disk() takes the same list.
  std::vector<std::pair<SceneLogStatePtr, Position>> written() const LOCUS_EXCLUDES(mutex_);
  void on_disk(const std::vector<std::pair<SceneLogStatePtr, Position>>& positions) LOCUS_EXCLUDES(mutex_);

  // A change of the catalogue has come to the disk: its totals, and the row of `scene` if the change was of one;
  // without a row the scene is gone.
  void set_catalogue(const CatalogueRow& totals) LOCUS_EXCLUDES(mutex_);
  void set_row(SceneLogState& scene, const SceneRow& row, uint64_t row_checksum, const CatalogueRow& totals)
      LOCUS_EXCLUDES(mutex_);
  void remove(SceneKey scene, const CatalogueRow& totals) LOCUS_EXCLUDES(mutex_);

  // All that HIGH_WATER says of scenes and the catalogue, over what it said before. `database_sequence` is RocksDB's
  // number of the last write, asked for before this.
  void describe(uint64_t database_sequence, DurableMarker& durable_marker) const LOCUS_EXCLUDES(mutex_);

 private:
  mutable Mutex mutex_;
  std::map<SceneKey, SceneLogStatePtr> scenes_ LOCUS_GUARDED_BY(mutex_);
  CatalogueRow totals_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_SCENE_TABLE_H_
