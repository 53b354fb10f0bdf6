// Table of the scenes' logs: the last written and the last synced record of each. The durable marker is filled from it.
//
// Threads: every member may be called from any thread; the lock is held briefly, never during disk I/O. Invariants:
// `synced` never passes `written`, and neither goes back; so fill_marker() names only data that is already synced.
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

// Position in a scene's log: the last record up to there, and its checksum.
struct Position {
  uint64_t sequence = 0;
  uint64_t running_checksum = 0;
};

// State of a scene's log. The lock of the table guards every member except `writing`.
struct SceneLogState {
  SceneKey key = 0;
  std::string name;
  absl::Status damage;
  std::string damage_found;  // the damage as the durable marker stores it
  uint64_t epoch = 0;
  uint64_t row_checksum = 0;
  bool copied = false;
  Position written;
  Position synced;
  // Last record of failed appends. Such records may still be in RocksDB's log and reappear; the next append overwrites
  // or deletes them.
  uint64_t possibly_written_end = 0;
  // Set while an append is in progress: RocksDB's last sequence number before it.
  std::optional<uint64_t> append_began_at;
  bool deleted = false;
  Mutex writing;  // held from begin_append() to the end of the write: writes to a scene never overtake each other
};

using SceneLogStatePtr = std::shared_ptr<SceneLogState>;

class SceneTable {
 public:
  struct Start {
    Position written;
    uint64_t possibly_written_end = 0;
  };

  void add(SceneLogStatePtr scene) LOCUS_EXCLUDES(mutex_);
  // Returns the scene. NOT_FOUND if it is unknown, its damage if it is damaged.
  absl::StatusOr<SceneLogStatePtr> find(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  // Returns the scene even if it is damaged; null if it is unknown.
  SceneLogStatePtr find_any(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  bool has_name(absl::string_view name) const LOCUS_EXCLUDES(mutex_);
  size_t size() const LOCUS_EXCLUDES(mutex_);
  uint64_t last_of(const SceneLogState& scene) const LOCUS_EXCLUDES(mutex_);

  // Begins an append. The caller holds `writing` until end_append() or fail_append(). FAILED_PRECONDITION for another
  // epoch, NOT_FOUND if the scene was deleted.
  absl::StatusOr<Start> begin_append(SceneLogState& scene, uint64_t epoch, uint64_t database_sequence)
      LOCUS_EXCLUDES(mutex_);
  // Ends an append that succeeded: `written` is the position of its last record.
  void end_append(SceneLogState& scene, Position written, bool synced) LOCUS_EXCLUDES(mutex_);
  // Ends an append that failed: its records, up to `last`, may still be in RocksDB's log.
  void fail_append(SceneLogState& scene, uint64_t last) LOCUS_EXCLUDES(mutex_);

  // Returns the written positions of all scenes. After a sync the caller hands them to mark_synced().
  std::vector<std::pair<SceneLogStatePtr, Position>> written() const LOCUS_EXCLUDES(mutex_);
  void mark_synced(const std::vector<std::pair<SceneLogStatePtr, Position>>& positions) LOCUS_EXCLUDES(mutex_);

  // Record a synced change of the catalogue: its new totals, and the changed row of a scene or its removal.
  void set_catalogue(const CatalogueRow& totals) LOCUS_EXCLUDES(mutex_);
  void set_row(SceneLogState& scene, const SceneRow& row, uint64_t row_checksum, const CatalogueRow& totals)
      LOCUS_EXCLUDES(mutex_);
  void remove(SceneKey scene, const CatalogueRow& totals) LOCUS_EXCLUDES(mutex_);

  // Fills the marker's entries for scenes and catalogue; keeps its other members. `database_sequence` is RocksDB's last
  // sequence number, read before this call.
  void fill_marker(uint64_t database_sequence, DurableMarker& durable_marker) const LOCUS_EXCLUDES(mutex_);

 private:
  void check_invariants(const SceneLogState& scene) const LOCUS_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::map<SceneKey, SceneLogStatePtr> scenes_ LOCUS_GUARDED_BY(mutex_);
  CatalogueRow totals_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_SCENE_TABLE_H_
