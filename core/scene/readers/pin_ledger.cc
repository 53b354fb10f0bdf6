#include "core/scene/readers/pin_ledger.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "core/scene/snapshot/snapshot_bytes.h"

namespace locus {
namespace {

// Bytes are counted again only once this part of the budget was replaced since the last time, so that pins just below
// the budget do not make every batch count. What pins hold may pass the budget by as much.
constexpr uint64_t kCountShare = 64;
// What a revision holds and a later one does not takes at most so many times what is known to be replaced in between:
// the maps that find it are not known. Measured: up to 2.2 times.
constexpr uint64_t kMaxOfReplaced = 4;
constexpr uint32_t kRetryMs = 10;

absl::Status told_to_end(uint64_t revision, uint64_t budget, uint64_t held) {
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.limit = "pinned_bytes";
  refusal.limit_value = static_cast<double>(budget);
  refusal.asked = static_cast<double>(held);
  refusal.retry_after_ms = kRetryMs;
  return refuse(absl::StatusCode::kResourceExhausted,
                absl::StrCat("limit pinned_bytes is ", budget, "; revisions that were still read held ", held,
                             " bytes that updates had replaced, and this read revision ", revision,
                             ", the oldest. Ask again, in smaller batches if it happens again"),
                refusal);
}

}  // namespace

SnapshotPin::SnapshotPin(std::shared_ptr<PinLedger> ledger, SnapshotPtr snapshot)
    : ledger_(std::move(ledger)), snapshot_(std::move(snapshot)), place_(ledger_->add(snapshot_)) {}

SnapshotPin::~SnapshotPin() {
  if (ledger_ == nullptr) return;
  // Freed before the writer may go on, and outside the lock: it takes a while.
  snapshot_.reset();
  ledger_->remove(place_, cut_.get());
}

absl::Status SnapshotPin::status() const {
  const Pinned& pinned = place_->second;
  if (!pinned.ended.load(std::memory_order_acquire)) return absl::OkStatus();
  return told_to_end(place_->first, pinned.budget, pinned.held);
}

void SnapshotPin::when_stuck(std::function<void()> cut) {
  cut_ = std::make_shared<Cut>(&place_->second, std::move(cut));
  ledger_->add_cut(cut_);
}

uint64_t PinLedger::budget_for(uint64_t scene_bytes) const {
  return fixed_ != 0 ? fixed_ : std::max(limits::kPinnedBytes, limits::kPinnedShare * scene_bytes);
}

SnapshotPin::Place PinLedger::add(const SnapshotPtr& snapshot) {
  const MutexLock lock(mutex_);
  const auto [place, added] = pinned_.try_emplace(snapshot->revision);
  SnapshotPin::Pinned& pinned = place->second;
  ++pinned.pins;
  if (!added) return place;
  pinned.snapshot = snapshot;
  pinned.replaced_bytes = snapshot->replaced_bytes;
  if (snapshot->replaced_bytes < judged_at_) late_bytes_ += judged_at_ - snapshot->replaced_bytes;
  return place;
}

void PinLedger::remove(SnapshotPin::Place place, const SnapshotPin::Cut* cut) {
  const MutexLock lock(mutex_);
  if (cut != nullptr) cuts_.remove_if([cut](const auto& one) { return one.get() == cut; });
  if (--place->second.pins > 0) return;
  const bool ended = place->second.ended;
  pinned_.erase(place);
  if (ended && --ended_ == 0) returned_.notify_all();
}

void PinLedger::add_cut(std::shared_ptr<SnapshotPin::Cut> cut) {
  const MutexLock lock(mutex_);
  cuts_.push_back(std::move(cut));
}

bool PinLedger::may_exceed(const SceneSnapshot& latest) const {
  if (pinned_.empty() || pinned_.begin()->first >= latest.revision) return false;
  const uint64_t since_count = latest.replaced_bytes - counted_at_;
  const uint64_t since_oldest = latest.replaced_bytes - pinned_.begin()->second.replaced_bytes;
  return since_count >= budget_ / kCountShare && kMaxOfReplaced * since_oldest > budget_ &&
         counted_ + kMaxOfReplaced * (late_bytes_ + since_count) > budget_;
}

std::vector<PinLedger::Holding> PinLedger::pinned_before(const SceneSnapshot& latest) const {
  std::vector<Holding> pinned;
  for (auto place = pinned_.begin(); place != pinned_.lower_bound(latest.revision); ++place)
    if (SnapshotPtr snapshot = place->second.snapshot.lock(); snapshot != nullptr)
      pinned.push_back({std::move(snapshot), 0});
  return pinned;
}

// What was replaced between two pinned revisions is held by the older one, and by those before it that had it already:
// so nothing is counted twice.
uint64_t PinLedger::count(std::vector<Holding>& pinned, const SceneSnapshot& latest) {
  uint64_t held = 0;
  for (size_t i = 0; i < pinned.size(); ++i) {
    const SceneSnapshot& next = i + 1 < pinned.size() ? *pinned[i + 1].snapshot : latest;
    pinned[i].bytes = bytes_apart_from(*pinned[i].snapshot, next);
    held += pinned[i].bytes;
  }
  return held;
}

void PinLedger::judge(const SceneSnapshot& latest) {
  std::vector<Holding> pinned;
  {
    const MutexLock lock(mutex_);
    judged_at_ = latest.replaced_bytes;
    if (!may_exceed(latest)) return;
    late_bytes_ = 0;
    pinned = pinned_before(latest);
  }
  uint64_t held = count(pinned, latest);
  // Measuring the scene takes longer than counting what is held.
  const uint64_t budget = budget_for(held <= budget_for(0) ? 0 : bytes_of(latest));
  const MutexLock lock(mutex_);
  budget_ = budget;
  counted_at_ = latest.replaced_bytes;
  const uint64_t held_by_all = held;
  for (size_t i = 0; held > budget; ++i) {
    end(*pinned[i].snapshot, held_by_all);
    held -= pinned[i].bytes;
  }
  counted_ = held;
}

void PinLedger::end(const SceneSnapshot& snapshot, uint64_t held) {
  const auto place = pinned_.find(snapshot.revision);
  if (place == pinned_.end() || place->second.ended) return;
  place->second.budget = budget_;
  place->second.held = held;
  place->second.ended.store(true, std::memory_order_release);
  ++ended_;
}

bool PinLedger::over() const {
  const MutexLock lock(mutex_);
  return ended_ > 0 && !closed_;
}

uint64_t PinLedger::budget() const {
  const MutexLock lock(mutex_);
  return budget_;
}

bool PinLedger::wait_until_returned(Time until) const {
  const MutexLock lock(mutex_);
  while (ended_ > 0 && !closed_) {
    if (until == kNever)
      returned_.wait(mutex_);
    else if (!returned_.wait_until(mutex_, until))
      return ended_ == 0 || closed_;
  }
  return true;
}

void PinLedger::cut_off() {
  const MutexLock lock(mutex_);
  for (const std::shared_ptr<SnapshotPin::Cut>& cut : cuts_)
    if (cut->first->ended) std::exchange(cut->second, [] {})();
}

void PinLedger::close() {
  const MutexLock lock(mutex_);
  closed_ = true;
  returned_.notify_all();
}

PinLedger::Use PinLedger::use(const SceneSnapshot& latest, uint64_t latest_bytes) const {
  std::vector<Holding> pinned;
  {
    const MutexLock lock(mutex_);
    pinned = pinned_before(latest);
  }
  return {count(pinned, latest), budget_for(latest_bytes)};
}

}  // namespace locus
