#include "core/scene/snapshot/scene_snapshot.h"

#include <algorithm>

#include "core/base/check.h"

namespace locus {
namespace {

// Returns the first history record of `snapshot` at or after `tick`, or null if there is no such record.
const HistoryRecord* first_record(const SceneSnapshot& snapshot, uint64_t tick) {
  if (snapshot.history == nullptr) return nullptr;
  const auto& records = snapshot.history->records;
  const auto first = std::lower_bound(
      records.begin(), records.end(), tick,
      [](const std::shared_ptr<const HistoryRecord>& record, uint64_t at) { return record->tick < at; });
  return first == records.end() ? nullptr : first->get();
}

// Returns the number of bytes that the history of `held` holds and the history of `later` does not hold. For a record
// whose tick `later` has dropped, adds HistoryRecord::bytes. This number does not include the memory that the record
// shares with the next record of `held`. If `later` has dropped the next record as well, the shared memory is included
// in the bytes of the next record; otherwise `later` still holds the shared memory. The last record of `held` has no
// next record: its bytes do not include the memory that it shares with the first revision after its tick. The caller
// counts the part of this memory that belongs to held.objects.
uint64_t unshared_history_bytes(const SceneSnapshot& held, const SceneSnapshot& later) {
  if (held.history == nullptr || held.history == later.history) return 0;
  uint64_t bytes = 0;
  for (const std::shared_ptr<const HistoryRecord>& record : held.history->records) {
    const HistoryRecord* kept = first_record(later, record->tick);
    if (kept == record.get()) continue;
    // Appending a record replaces the previous record by a copy with the same objects. Therefore compare the objects of
    // two records of the same tick, not the pointers to the records.
    const bool same_tick = kept != nullptr && kept->tick == record->tick;
    bytes += same_tick ? record->objects.unshared_bytes(kept->objects) + record->statics->unshared_bytes(*kept->statics)
                       : record->bytes;
  }
  return bytes;
}

// Returns the bytes of the expiries of `held` that `later`, which may be null, does not hold.
uint64_t unshared_expiry_bytes(const SceneSnapshot& held, const SceneSnapshot* later) {
  return held.expiries == nullptr ? 0
                                  : held.expiries->unshared_bytes(later == nullptr ? nullptr : later->expiries.get());
}

}  // namespace

uint64_t unshared_bytes(const SceneSnapshot& held, const SceneSnapshot& later) {
  LOCUS_DCHECK_LE(held.revision, later.revision);
  // Among the sets of objects that `later` holds, the first set at or after the tick of `held` shares the most memory
  // with `held`.
  const HistoryRecord* next = first_record(later, held.tick);
  return held.statics->unshared_bytes(next == nullptr ? *later.statics : *next->statics) +
         held.objects.unshared_bytes(next == nullptr ? later.objects : next->objects) +
         unshared_history_bytes(held, later) + unshared_expiry_bytes(held, &later);
}

uint64_t bytes_of(const SceneSnapshot& snapshot) {
  return snapshot.statics->bytes() + snapshot.objects.bytes() + unshared_expiry_bytes(snapshot, nullptr);
}

}  // namespace locus
