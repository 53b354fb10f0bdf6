// Table of the scenes' logs: the last written and the last synced record of each. The durable marker is filled from
// this table.
//
// Threads: every member may be called from any thread; the table's lock is held briefly, never during disk I/O.
// Invariants: `synced` is never after `written`, and neither decreases; so fill_marker() names only data that is
// already synced.
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

// Position in a scene's log: the sequence number of a record, and the checksum over all records up to it.
struct Position {
  uint64_t sequence = 0;
  uint64_t running_checksum = 0;
};

// State of a scene's log. The table's lock guards every member except `writing`.
struct SceneLogState {
  SceneKey key = 0;
  std::string name;
  absl::Status damage;
  std::string damage_found;  // description of the damage, as the durable marker stores it; empty if intact
  uint64_t epoch = 0;
  uint64_t row_checksum = 0;
  bool copied = false;
  Position written;
  Position synced;
  // Sequence number of the last record of failed appends. The records after `written` up to this one may still be in
  // RocksDB's log and reappear, so the next append overwrites or deletes them.
  uint64_t possibly_written_end = 0;
  // Last sequence number that RocksDB had used before the append in progress; nothing if there is none.
  std::optional<uint64_t> append_began_at;
  bool deleted = false;
  Mutex writing;  // held during a whole append, so that writes to a scene never overtake each other
};

using SceneLogStatePtr = std::shared_ptr<SceneLogState>;

class SceneTable {
 public:
  struct Start {
    Position written;
    uint64_t possibly_written_end = 0;
  };

  void add(SceneLogStatePtr scene) LOCUS_EXCLUDES(mutex_);
  // Returns the scene. NOT_FOUND if it is unknown; if the scene is damaged, the status that describes the damage.
  absl::StatusOr<SceneLogStatePtr> find(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  // Returns the scene even if it is damaged; null if it is unknown.
  SceneLogStatePtr find_any(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  bool has_name(absl::string_view name) const LOCUS_EXCLUDES(mutex_);
  size_t size() const LOCUS_EXCLUDES(mutex_);
  uint64_t last_of(const SceneLogState& scene) const LOCUS_EXCLUDES(mutex_);

  // Begins an append and returns the position after which it writes. The caller must hold `scene.writing` from before
  // this call until end_append() or fail_append() has returned. `database_sequence` is RocksDB's last sequence number
  // now. FAILED_PRECONDITION if the scene's epoch is not `epoch`, NOT_FOUND if the scene was deleted.
  absl::StatusOr<Start> begin_append(SceneLogState& scene, uint64_t epoch, uint64_t database_sequence)
      LOCUS_EXCLUDES(mutex_);
  // Ends an append that succeeded. `written` is the position of its last record; `synced` says whether that record is
  // synced.
  void end_append(SceneLogState& scene, Position written, bool synced) LOCUS_EXCLUDES(mutex_);
  // Ends an append that failed. Its records, up to sequence number `last`, may still be in RocksDB's log.
  void fail_append(SceneLogState& scene, uint64_t last) LOCUS_EXCLUDES(mutex_);

  // Returns the last written position of each scene. Call it before a sync, and pass the result to mark_synced() after
  // the sync.
  std::vector<std::pair<SceneLogStatePtr, Position>> written() const LOCUS_EXCLUDES(mutex_);
  void mark_synced(const std::vector<std::pair<SceneLogStatePtr, Position>>& positions) LOCUS_EXCLUDES(mutex_);

  // Record a synced change of the catalogue: its new totals, and the changed row of a scene or the removal of a scene.
  void set_catalogue(const CatalogueRow& totals) LOCUS_EXCLUDES(mutex_);
  void set_row(SceneLogState& scene, const SceneRow& row, uint64_t row_checksum, const CatalogueRow& totals)
      LOCUS_EXCLUDES(mutex_);
  void remove(SceneKey scene, const CatalogueRow& totals) LOCUS_EXCLUDES(mutex_);

  // Fills the members of the marker that concern scenes and the catalogue, and leaves its other members unchanged.
  // `database_sequence` is RocksDB's last sequence number, read before this call.
  void fill_marker(uint64_t database_sequence, DurableMarker& durable_marker) const LOCUS_EXCLUDES(mutex_);

 private:
  void check_invariants(const SceneLogState& scene) const LOCUS_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::map<SceneKey, SceneLogStatePtr> scenes_ LOCUS_GUARDED_BY(mutex_);
  CatalogueRow totals_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_SCENE_TABLE_H_
