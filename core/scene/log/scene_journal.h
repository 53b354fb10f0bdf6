// What a scene writes down before it does it: the scene's side of its log. Without a log it does nothing.
//
// Threads: append...() and remove() by the scene's one writer at a time, they wait for the disk; position() and
// snapshot_written() by any thread, they never do.
#ifndef LOCUS_CORE_SCENE_LOG_SCENE_JOURNAL_H_
#define LOCUS_CORE_SCENE_LOG_SCENE_JOURNAL_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// How far a scene's log reaches.
struct LogPosition {
  uint64_t sequence = 0;           // of the last record
  uint64_t snapshot_sequence = 0;  // the snapshot holds all up to here
  uint64_t bytes = 0;              // of the records after that
};

// Where a scene is logged; without `log` it is not.
struct SceneLog {
  UpdateLog* log = nullptr;  // outlives the scene
  SceneKey key = 0;
  AckLevel level = AckLevel::kLocal;
  LogPosition position;  // where it goes on
};

class SceneJournal {
 public:
  explicit SceneJournal(const SceneLog& log) : log_(log), position_(log.position) {}

  bool on() const { return log_.log != nullptr; }
  SceneKey key() const { return log_.key; }

  // Each batch as a record of its own, all or none, with one sync. After an error nothing is logged.
  absl::Status append_each(uint64_t epoch, absl::Span<const UpdateBatch* const> batches) LOCUS_EXCLUDES(mutex_);
  // Batches that become one revision, as one record.
  absl::Status append_joined(uint64_t epoch, absl::Span<const UpdateBatch* const> batches) LOCUS_EXCLUDES(mutex_);
  // On the disk whatever the scene's level: a mesh that is used no more may be deleted next.
  absl::Status append_change(uint64_t epoch, const StaticChange& change, absl::Span<const Id> placed)
      LOCUS_EXCLUDES(mutex_);
  // The scene with all that is kept of it.
  absl::Status remove();

  LogPosition position() const LOCUS_EXCLUDES(mutex_);
  // Of all records that were ever appended here, and of those it began with: grows only.
  uint64_t total_bytes() const LOCUS_EXCLUDES(mutex_);
  // The snapshot holds all up to `sequence` now, before which `total_bytes` had been logged.
  void snapshot_written(uint64_t sequence, uint64_t total_bytes) LOCUS_EXCLUDES(mutex_);

 private:
  // Ends the record that was written to bytes_ since the last one.
  void end_record(uint64_t epoch, const UpdateBatch& numbers);
  absl::Status append(AckLevel level) LOCUS_EXCLUDES(mutex_);

  const SceneLog log_;
  // The records at work.
  std::string bytes_;
  std::vector<LogEntry> entries_;
  std::vector<size_t> ends_;

  mutable Mutex mutex_;
  LogPosition position_ LOCUS_GUARDED_BY(mutex_);
  uint64_t bytes_in_snapshots_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_SCENE_JOURNAL_H_
