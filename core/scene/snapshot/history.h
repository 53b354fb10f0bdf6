// The past of a scene: what its objects were at the end of each of the last ticks, and what is kept of it. Records
// share with each other and with the present whatever has not changed between them, so that one costs what the tick
// changed. Immutable once published; any thread.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_HISTORY_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_HISTORY_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "core/scene/objects/object_set.h"
#include "core/scene/objects/tick_moves.h"

namespace locus {

struct HistoryRecord {
  uint64_t tick = 0;
  ObjectSet objects;     // at the end of that tick
  Displacement to_next;  // from there to the next record. Of the last one the snapshot says it, for its own moment
  size_t bytes = 0;      // of what the next record, or the present, does not share
};

struct History {
  std::vector<std::shared_ptr<const HistoryRecord>> records;  // ascending by tick, all below the scene's
  size_t bytes = 0;                                           // of all records
};
using HistoryPtr = std::shared_ptr<const History>;

// Why the past of a scene begins at its oldest tick: the reason that no tick before that is kept.
enum class PastLimit : uint8_t {
  kOff,       // the scene keeps no past
  kBegan,     // there is no tick before: the scene began there, or restarted its ticks
  kTicks,     // older ticks are further back than HistoryOptions::ticks
  kBytes,     // older ticks did not fit into HistoryOptions::bytes
  kRestored,  // the scene was read from a snapshot on disk, which holds nothing of the past
};

struct HistoryOptions {
  // How many ticks back the past can be asked about. 0 keeps none, and costs nothing.
  uint32_t ticks = 0;
  // Of memory that records may hold; beyond it the oldest go. One tick at a time is counted, when it ends, and once
  // when the next one begins.
  uint64_t bytes = 0;
};

// The writer's side: adds records, drops old ones. One thread at a time.
class HistoryRecorder {
 public:
  explicit HistoryRecorder(const HistoryOptions& options) : options_(options) {}

  bool on() const { return options_.ticks != 0; }
  // Null when nothing is kept.
  const HistoryPtr& history() const { return history_; }

  // `tick` ended as `objects`, `since_last` after the last record, and `next_tick` begins. O(records and what the tick
  // changed).
  void close(uint64_t tick, const ObjectSet& objects, const Displacement& since_last, uint64_t next_tick);
  // What the present is now, so that memory is counted for the last record, too. Once after close().
  void measure(const ObjectSet& now);
  void drop();
  // Whether a tick ended since drop(), kept or not: unlike what is kept, which goes by memory, this says the same for
  // the same batches at any time.
  bool has_past() const { return has_past_; }
  // Begins with a scene read from disk, whose past, if it had one, is lost.
  void restore(bool has_past);
  PastLimit limit() const { return on() ? limit_ : PastLimit::kOff; }
  // Of all records so far that are not kept any more.
  uint64_t dropped_bytes() const { return dropped_bytes_; }
  // Nothing that is only in records below this tick is kept.
  uint64_t oldest_tick(uint64_t present) const { return history_ == nullptr ? present : history_->records[0]->tick; }

 private:
  void drop_first(History& history, size_t count, PastLimit reason);
  void publish(History history);

  HistoryOptions options_;
  HistoryPtr history_;
  bool measured_ = true;
  bool has_past_ = false;
  PastLimit limit_ = PastLimit::kBegan;
  uint64_t dropped_bytes_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_HISTORY_H_
