// Table of the scenes' logs: the last written and the last synced record of each scene. fill_marker() copies the synced
// positions into the durable marker, so the marker names only data that is already synced.
//
// Threads: every member may be called from any thread; the table's lock is held briefly, never during disk I/O.
// Invariants: a scene's `synced` position is never after its `written` position, and neither position decreases.
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

// Position in a scene's log: the sequence number of a record, and the checksum over all records up to that record.
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
  // Sequence number of the last record of failed appends; 0 if no append failed since the last successful one. Records
  // after `written` up to this number may still be in RocksDB's log and reappear after a restart, so the next append
  // overwrites or deletes them.
  uint64_t possibly_written_end = 0;
  // Last sequence number that RocksDB had used before the append in progress; no value if no append is in progress.
  std::optional<uint64_t> append_began_at;
  bool deleted = false;
  Mutex writing;  // held during a whole append, so that records are written in the order of their sequence numbers
};

using SceneLogStatePtr = std::shared_ptr<SceneLogState>;

class SceneTable {
 public:
  struct Start {
    Position written;
    uint64_t possibly_written_end = 0;
  };

  void add(SceneLogStatePtr scene) LOCUS_EXCLUDES(mutex_);
  // Returns the scene. Returns NOT_FOUND if the table has no such scene, and SceneLogState::damage if the scene is
  // damaged.
  absl::StatusOr<SceneLogStatePtr> find(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  // Returns the scene even if it is damaged; null if the table has no such scene.
  SceneLogStatePtr find_any(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  bool has_name(absl::string_view name) const LOCUS_EXCLUDES(mutex_);
  size_t size() const LOCUS_EXCLUDES(mutex_);
  uint64_t last_of(const SceneLogState& scene) const LOCUS_EXCLUDES(mutex_);

  // Begins an append. Returns the position of the scene's last record, which the append's records follow. The caller
  // must hold `scene.writing` from before this call until end_append() or fail_append() has returned.
  // `database_sequence` is RocksDB's current last sequence number. FAILED_PRECONDITION if the scene's epoch is not
  // `epoch`, NOT_FOUND if the scene was deleted.
  absl::StatusOr<Start> begin_append(SceneLogState& scene, uint64_t epoch, uint64_t database_sequence)
      LOCUS_EXCLUDES(mutex_);
  // Ends an append that succeeded. `written` is the position of the append's last record; `synced` says whether that
  // record is synced.
  void end_append(SceneLogState& scene, Position written, bool synced) LOCUS_EXCLUDES(mutex_);
  // Ends an append that failed. `last` is the sequence number of its last record. Its records may still be in RocksDB's
  // log.
  void fail_append(SceneLogState& scene, uint64_t last) LOCUS_EXCLUDES(mutex_);

  // Returns the last written position of each scene. Call it before a sync, and pass the result to mark_synced() after
  // the sync.
  std::vector<std::pair<SceneLogStatePtr, Position>> written() const LOCUS_EXCLUDES(mutex_);
  void mark_synced(const std::vector<std::pair<SceneLogStatePtr, Position>>& positions) LOCUS_EXCLUDES(mutex_);

  // Record a synced change of the catalogue. These three functions store the catalogue's new totals; set_row() also
  // stores data of a scene's changed row, and remove() removes a scene.
  void set_catalogue(const CatalogueRow& totals) LOCUS_EXCLUDES(mutex_);
  void set_row(SceneLogState& scene, const SceneRow& row, uint64_t row_checksum, const CatalogueRow& totals)
      LOCUS_EXCLUDES(mutex_);
  void remove(SceneKey scene, const CatalogueRow& totals) LOCUS_EXCLUDES(mutex_);

  // Fills the members of the marker that concern scenes and the catalogue. If all written records are synced, also sets
  // flushed_sequence. Its value is then `database_sequence` (RocksDB's last sequence number, read before this call), or
  // a lower number while an append is in progress. Leaves the other members unchanged.
  void fill_marker(uint64_t database_sequence, DurableMarker& durable_marker) const LOCUS_EXCLUDES(mutex_);

 private:
  void check_invariants(const SceneLogState& scene) const LOCUS_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::map<SceneKey, SceneLogStatePtr> scenes_ LOCUS_GUARDED_BY(mutex_);
  CatalogueRow totals_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_SCENE_TABLE_H_
