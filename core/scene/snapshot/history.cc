#include "core/scene/snapshot/history.h"

#include <utility>

#include "core/base/check.h"

namespace locus {
namespace {

// Returns a copy of `record` in which `bytes` is the memory that the record does not share with `objects` and
// `statics`: those of the next record or, if `record` is the last record, the current ones.
std::shared_ptr<const HistoryRecord> with_bytes(const HistoryRecord& record, const ObjectSet& objects,
                                                const StaticSet& statics) {
  HistoryRecord counted = record;
  counted.bytes =
      sizeof(HistoryRecord) + record.objects.unshared_bytes(objects) + record.statics->unshared_bytes(statics);
  if (record.to_next.fast != nullptr) counted.bytes += record.to_next.fast->size() * sizeof(FastMover);
  return std::make_shared<const HistoryRecord>(std::move(counted));
}

}  // namespace

void HistoryRecorder::check_invariants() const {
  if (history_ == nullptr) return;
  LOCUS_CHECK(on() && has_past_);
  LOCUS_CHECK(!history_->records.empty());
  LOCUS_CHECK_LE(uint64_t{history_->bytes}, options_.bytes);
  size_t bytes = 0;
  const HistoryRecord* previous = nullptr;
  for (const std::shared_ptr<const HistoryRecord>& record : history_->records) {
    if (previous != nullptr) LOCUS_CHECK_LT(previous->tick, record->tick);
    bytes += record->bytes;
    previous = record.get();
  }
  LOCUS_CHECK_EQ(bytes, history_->bytes);
}

void HistoryRecorder::close(uint64_t tick, const ObjectSet& objects, std::shared_ptr<const StaticSet> statics,
                            const Displacement& since_last, uint64_t next_tick) {
  LOCUS_DCHECK_LT(tick, next_tick);
  LOCUS_DCHECK(history_ == nullptr || history_->records.back()->tick < tick);
  has_past_ = true;
  History next;
  if (history_ != nullptr) {
    next = *history_;
    HistoryRecord last = *next.records.back();
    last.to_next = since_last;
    next.records.back() = with_bytes(last, objects, *statics);
  }
  next.records.push_back(std::make_shared<const HistoryRecord>(
      HistoryRecord{tick, objects, std::move(statics), {}, sizeof(HistoryRecord)}));
  size_t first = 0;
  while (first + 1 < next.records.size() && next_tick >= options_.ticks &&
         next.records[first + 1]->tick <= next_tick - options_.ticks)
    ++first;
  drop_first(next, first, PastLimit::kTicks);
  publish(std::move(next), options_.bytes, PastLimit::kBytes);
  measured_ = false;
}

void HistoryRecorder::restore(bool has_past) {
  LOCUS_DCHECK(history_ == nullptr && !has_past_);
  has_past_ = has_past;
  if (has_past) limit_ = PastLimit::kRestored;
}

void HistoryRecorder::drop() {
  has_past_ = false;
  limit_ = PastLimit::kBegan;
  if (history_ != nullptr) dropped_bytes_ += history_->bytes;
  history_ = nullptr;
}

bool HistoryRecorder::trim(uint64_t bytes) {
  if (history_ == nullptr || history_->bytes <= bytes) return false;
  publish(*history_, bytes, PastLimit::kMemory);
  return true;
}

bool HistoryRecorder::forget_mesh(const StaticMesh* mesh) {
  if (history_ == nullptr) return false;
  History next = *history_;
  size_t count = next.records.size();
  while (count > 0 && next.records[count - 1]->statics->uses(mesh) == 0) --count;
  if (count == 0) return false;
  drop_first(next, count, PastLimit::kMemory);
  publish(std::move(next), options_.bytes, PastLimit::kBytes);
  return true;
}

void HistoryRecorder::drop_first(History& history, size_t count, PastLimit reason) {
  if (count > 0) limit_ = reason;
  if (forgets_early(reason)) forgotten_ticks_ += count;
  LOCUS_DCHECK_LE(count, history.records.size());
  for (size_t i = 0; i < count; ++i) dropped_bytes_ += history.records[i]->bytes;
  history.records.erase(history.records.begin(), history.records.begin() + static_cast<std::ptrdiff_t>(count));
}

void HistoryRecorder::measure(const ObjectSet& objects, const StaticSet& statics) {
  if (std::exchange(measured_, true) || history_ == nullptr) return;
  History next = *history_;
  next.records.back() = with_bytes(*next.records.back(), objects, statics);
  publish(std::move(next), options_.bytes, PastLimit::kBytes);
}

void HistoryRecorder::publish(History history, uint64_t max_bytes, PastLimit reason) {
  history.bytes = 0;
  size_t first = history.records.size();
  while (first > 0 && history.bytes + history.records[first - 1]->bytes <= max_bytes)
    history.bytes += history.records[--first]->bytes;
  drop_first(history, first, reason);
  history_ = history.records.empty() ? nullptr : std::make_shared<const History>(std::move(history));
  LOCUS_DCHECK_CALL(check_invariants());
}

}  // namespace locus
