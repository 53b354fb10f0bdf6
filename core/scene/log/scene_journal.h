// Write-ahead journal of a scene: encodes each batch or static change that the scene is about to apply, and appends
// the encoded record to the log. Does nothing if the scene has no log.
//
// Threads: only the scene's writer, one thread at a time, calls append_...() and remove(), which wait for the disk; any
// thread may call position(), total_bytes() and snapshot_written(), which never wait. Invariants of the position:
// snapshot_sequence <= sequence, and total_bytes() never decreases.
#ifndef LOCUS_CORE_SCENE_LOG_SCENE_JOURNAL_H_
#define LOCUS_CORE_SCENE_LOG_SCENE_JOURNAL_H_

#include <atomic>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// Sequence numbers and size of a scene's log.
struct LogPosition {
  uint64_t sequence = 0;           // sequence number of the last record
  uint64_t snapshot_sequence = 0;  // sequence number of the last record whose effect is in the snapshot
  uint64_t bytes = 0;              // size in bytes of the records after the snapshot
};

// Log of one scene. If `log` is null, the scene is not logged.
struct SceneLog {
  UpdateLog* log = nullptr;  // outlives the scene
  SceneKey key = 0;
  AckLevel level = AckLevel::kLocal;
  LogPosition position;  // position of the log when the journal is created
};

class SceneJournal {
 public:
  explicit SceneJournal(const SceneLog& log) : log_(log), key_(log.key), position_(log.position) {}

  bool on() const { return log_.log != nullptr; }
  // Returns the key of the scene in its log; 0 without a log. Any thread.
  SceneKey key() const { return key_.load(); }
  // Begins to append to `log`, whose last record is the last one that the scene has applied. Precondition: !on().
  void begin(const SceneLog& log) LOCUS_EXCLUDES(mutex_);

  // Appends one record for each batch, with a single sync. After an error, treat all batches as not logged: see
  // UpdateLog.
  absl::Status append_each(uint64_t epoch, absl::Span<const UpdateBatch* const> batches) LOCUS_EXCLUDES(mutex_);
  // Appends a single record for all batches, which become one revision.
  absl::Status append_joined(uint64_t epoch, absl::Span<const UpdateBatch* const> batches) LOCUS_EXCLUDES(mutex_);
  // Appends a static change, and syncs the change even for a scene with AckLevel::kMemory. The change may remove the
  // last instance of a mesh, and the mesh may then be deleted. If a crash lost the change, the recovered scene would
  // need the deleted mesh.
  absl::Status append_change(uint64_t epoch, const StaticChange& change, absl::Span<const Id> placed)
      LOCUS_EXCLUDES(mutex_);
  // Replaces the encoded specification of the scene.
  absl::Status set_spec(absl::string_view spec);
  // Deletes the scene from the log.
  absl::Status remove();

  LogPosition position() const LOCUS_EXCLUDES(mutex_);
  // Returns the size in bytes of all records that this journal has appended, plus the size of the records that followed
  // the snapshot when the journal was created. Never decreases.
  uint64_t total_bytes() const LOCUS_EXCLUDES(mutex_);
  // Records that the log's snapshot now includes all records up to `sequence`. `total_bytes` is the value that
  // total_bytes() returned when `sequence` was the last record.
  void snapshot_written(uint64_t sequence, uint64_t total_bytes) LOCUS_EXCLUDES(mutex_);

 private:
  // Checks that the sequence numbers are in order, and that position_.bytes is 0 if no record follows the snapshot.
  // O(1).
  void check_invariants() const LOCUS_REQUIRES(mutex_);
  // Ends the record that was last encoded into bytes_: adds its LogEntry, with the writer and batch number of `batch`,
  // to entries_, and its end offset to ends_.
  void end_record(uint64_t epoch, const UpdateBatch& batch);
  absl::Status append(AckLevel level) LOCUS_EXCLUDES(mutex_);

  SceneLog log_;  // changed only by begin()
  std::atomic<SceneKey> key_;
  // Records that are being appended: bytes_ is their encoding, entries_ has one entry for each record, and ends_ has
  // the end of each record as an offset in bytes_. All three are empty between calls.
  std::string bytes_;
  std::vector<LogEntry> entries_;
  std::vector<size_t> ends_;

  mutable Mutex mutex_;
  LogPosition position_ LOCUS_GUARDED_BY(mutex_);
  uint64_t bytes_in_snapshots_ LOCUS_GUARDED_BY(mutex_) = 0;  // total_bytes() after the last record in the snapshot
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_SCENE_JOURNAL_H_
