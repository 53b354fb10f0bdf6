// History of a scene: the objects and instances at the end of each recorded tick. Records share unchanged memory with
// each other and with the latest revision, so that a record costs only the memory that its tick changed. A History is
// immutable once published and may be read by any thread. Invariants: records are ascending by tick; History::bytes is
// the sum of HistoryRecord::bytes and at most HistoryOptions::bytes.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_HISTORY_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_HISTORY_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "core/scene/objects/object_set.h"
#include "core/scene/objects/tick_moves.h"
#include "core/scene/statics/static_set.h"

namespace locus {

struct HistoryRecord {
  uint64_t tick = 0;
  ObjectSet objects;                         // objects at the end of `tick`
  std::shared_ptr<const StaticSet> statics;  // instances at the end of `tick`
  // Displacement up to the next record. Not set in the last record: see SceneSnapshot::since_close.
  Displacement to_next;
  // Memory in bytes that is not shared with the next record. The last record of a history has no next record: its bytes
  // are the memory that is not shared with the first revision after `tick`.
  size_t bytes = 0;
};

struct History {
  std::vector<std::shared_ptr<const HistoryRecord>> records;  // ascending by tick, all before the scene's tick
  size_t bytes = 0;                                           // memory of all records
};
using HistoryPtr = std::shared_ptr<const History>;

// Reason why a history does not reach further back than its oldest tick.
enum class PastLimit : uint8_t {
  kOff,       // the scene keeps no history
  kBegan,     // there is no earlier tick: the scene began, or restarted its ticks, at the oldest tick
  kTicks,     // older ticks are more than HistoryOptions::ticks ticks before the current tick
  kBytes,     // older ticks did not fit into HistoryOptions::bytes
  kMemory,    // older ticks were dropped because the server was short of memory
  kRestored,  // the scene was read from a snapshot on disk, which contains no history
};

struct HistoryOptions {
  // Number of ticks before the current tick at which queries may be evaluated. With 0, no history is kept.
  uint32_t ticks = 0;
  // Maximum memory of all records in bytes; if the records exceed this maximum, the oldest records are dropped. The
  // memory of a record is counted when the first revision after its tick is made, and again when the next record is
  // appended.
  uint64_t bytes = 0;
};

// Returns true if ticks that HistoryOptions::ticks would keep were dropped to save memory.
constexpr bool forgets_early(PastLimit limit) { return limit == PastLimit::kBytes || limit == PastLimit::kMemory; }

// Recorder of the history, used by the writer: adds records and drops old records. One thread at a time.
class HistoryRecorder {
 public:
  explicit HistoryRecorder(const HistoryOptions& options) : options_(options) {}

  bool on() const { return options_.ticks != 0; }
  // Returns the history, or null if it has no record.
  const HistoryPtr& history() const { return history_; }

  // Appends a record with `objects` and `statics`, the objects and instances at the end of `tick`, and drops the
  // records that are too old once the scene is at `next_tick`. `since_last` is the displacement since the last record.
  // Precondition: last record's tick < `tick` < `next_tick`. O(records + memory that the tick changed).
  void close(uint64_t tick, const ObjectSet& objects, std::shared_ptr<const StaticSet> statics,
             const Displacement& since_last, uint64_t next_tick);
  // Measures how much memory of the last record is not shared with `objects` and `statics`, the current ones, and drops
  // the oldest records if all records together exceed HistoryOptions::bytes. Only the first call after each close() has
  // an effect.
  void measure(const ObjectSet& objects, const StaticSet& statics);
  // Drops all records.
  void drop();
  // Drops the oldest records until the rest takes at most `bytes`. Called when memory is short. Returns true if a
  // record was dropped. Does not change the memory limit for records that are added later.
  bool trim(uint64_t bytes);
  // Drops the records up to the last one that has instances of `mesh`. Called when the mesh was deleted. Returns true
  // if a record was dropped.
  bool forget_mesh(const StaticMesh* mesh);
  // Returns true if close() or restore(true) was called since the last drop(), even if all records were dropped to
  // save memory. The result depends on the batches alone, so that a replay of the same batches produces the same
  // revisions.
  bool has_past() const { return has_past_; }
  // Initialises the recorder of a scene that was read from disk. If `has_past` is true, the scene had a history, which
  // is lost.
  void restore(bool has_past);
  PastLimit limit() const { return on() ? limit_ : PastLimit::kOff; }
  // Returns the memory of all records dropped so far. Never decreases.
  uint64_t dropped_bytes() const { return dropped_bytes_; }
  // Returns the number of records that were dropped to save memory, and not because they were too old. Never decreases.
  uint64_t forgotten_ticks() const { return forgotten_ticks_; }
  // Returns the tick of the oldest record, or `present`, the current tick, if there is no record.
  uint64_t oldest_tick(uint64_t present) const { return history_ == nullptr ? present : history_->records[0]->tick; }

 private:
  // Checks the invariants of the published history. O(records).
  void check_invariants() const;
  void drop_first(History& history, size_t count, PastLimit reason);
  // Drops the oldest records of `history` until the rest takes at most `max_bytes`, and publishes the rest. If a record
  // is dropped, sets the result of limit() to `reason`.
  void publish(History history, uint64_t max_bytes, PastLimit reason);

  HistoryOptions options_;
  HistoryPtr history_;
  bool measured_ = true;  // false between close() and measure()
  bool has_past_ = false;
  PastLimit limit_ = PastLimit::kBegan;
  uint64_t dropped_bytes_ = 0;
  uint64_t forgotten_ticks_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_HISTORY_H_
