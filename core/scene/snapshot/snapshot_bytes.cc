#include "core/scene/snapshot/snapshot_bytes.h"

#include <algorithm>

namespace locus {
namespace {

// The first record of `snapshot` that is not from before `tick`; null where there is none.
const HistoryRecord* first_record(const SceneSnapshot& snapshot, uint64_t tick) {
  if (snapshot.history == nullptr) return nullptr;
  const auto& records = snapshot.history->records;
  const auto first = std::lower_bound(
      records.begin(), records.end(), tick,
      [](const std::shared_ptr<const HistoryRecord>& record, uint64_t at) { return record->tick < at; });
  return first == records.end() ? nullptr : first->get();
}

// What a record's bytes leave out is in the next one, which counts it or is kept.
uint64_t past_apart_from(const SceneSnapshot& held, const SceneSnapshot& later) {
  if (held.history == nullptr || held.history == later.history) return 0;
  uint64_t bytes = 0;
  for (const std::shared_ptr<const HistoryRecord>& record : held.history->records) {
    const HistoryRecord* kept = first_record(later, record->tick);
    if (kept == record.get()) continue;
    // The last record is made anew when the next one comes, of the same objects.
    const bool same_tick = kept != nullptr && kept->tick == record->tick;
    bytes += same_tick ? record->objects.unshared_bytes(kept->objects) : record->bytes;
  }
  return bytes;
}

}  // namespace

uint64_t unshared_bytes(const SceneSnapshot& held, const SceneSnapshot& later) {
  const uint64_t statics = held.statics == later.statics ? 0 : held.statics->bytes();
  // The first that the later revision still has of all that came after: it shares most.
  const HistoryRecord* next = first_record(later, held.tick);
  return statics + held.objects.unshared_bytes(next == nullptr ? later.objects : next->objects) +
         past_apart_from(held, later);
}

uint64_t bytes_of(const SceneSnapshot& snapshot) { return snapshot.statics->bytes() + snapshot.objects.bytes(); }

}  // namespace locus
