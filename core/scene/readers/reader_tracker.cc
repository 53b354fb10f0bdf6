#include "core/scene/readers/reader_tracker.h"

#include <algorithm>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

// Held bytes are counted again only after updates have replaced 1 / kCountShare of the budget since the last count. So
// pins just below the budget do not cause a count for every batch. Pins may therefore exceed the budget by up to
// kMaxOfReplaced times this share.
constexpr uint64_t kCountShare = 64;
// Upper bound of the ratio A / B for two revisions of a scene. A is the number of bytes that the earlier revision holds
// and the later revision does not hold. B is the difference of their SceneSnapshot::replaced_bytes, which does not
// count the lookup tables of the grid. The largest measured ratio is 2.2.
constexpr uint64_t kMaxOfReplaced = 4;
constexpr uint32_t kRetryMs = 10;

absl::Status revoked_status(uint64_t revision, uint64_t budget, uint64_t held) {
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.limit = "pinned_bytes";
  refusal.limit_value = static_cast<double>(budget);
  refusal.asked = static_cast<double>(held);
  refusal.retry_after_ms = kRetryMs;
  return refuse(absl::StatusCode::kResourceExhausted,
                absl::StrCat("limit pinned_bytes is ", budget, "; revisions in use by readers held ", held,
                             " bytes that updates had replaced, and this reader used the oldest one, ", revision,
                             ". Repeat the query; if this happens again, use smaller batches"),
                refusal);
}

}  // namespace

SnapshotPin::SnapshotPin(std::shared_ptr<ReaderTracker> tracker, SnapshotPtr snapshot)
    : tracker_(std::move(tracker)), snapshot_(std::move(snapshot)), entry_(tracker_->add(snapshot_)) {}

SnapshotPin::~SnapshotPin() {
  if (tracker_ == nullptr) return;
  // Free the snapshot before remove() lets the writer continue, and outside the lock, because freeing may take long.
  snapshot_.reset();
  tracker_->remove(entry_, revocation_.get());
}

absl::Status SnapshotPin::status() const {
  const Pinned& pinned = entry_->second;
  if (!pinned.revoked.load(std::memory_order_acquire)) return absl::OkStatus();
  return revoked_status(entry_->first.revision, pinned.budget, pinned.held);
}

void SnapshotPin::on_revoke(std::function<void()> revocation) {
  LOCUS_DCHECK(revocation_ == nullptr);
  revocation_ = std::make_shared<Revocation>(&entry_->second, std::move(revocation));
  tracker_->add_revocation(revocation_);
}

void ReaderTracker::check_invariants() const {
  LOCUS_CHECK_LE(size_t{revoked_}, pinned_.size());
  LOCUS_CHECK_LE(counted_at_, enforced_at_);
  LOCUS_CHECK_LE(counted_, budget_);
  LOCUS_CHECK(fixed_ == 0 || budget_ == fixed_);
}

uint64_t ReaderTracker::budget_for(uint64_t scene_bytes) const {
  return fixed_ != 0 ? fixed_ : std::max(limits::kPinnedBytes, limits::kPinnedShare * scene_bytes);
}

SnapshotPin::Entry ReaderTracker::add(const SnapshotPtr& snapshot) {
  const MutexLock lock(mutex_);
  const auto [entry, added] = pinned_.try_emplace(SnapshotPin::Age::of(*snapshot));
  SnapshotPin::Pinned& pinned = entry->second;
  ++pinned.pins;
  if (!added) {
    LOCUS_DCHECK(pinned.snapshot.lock() == snapshot);
    return entry;
  }
  pinned.snapshot = snapshot;
  const uint64_t replaced = snapshot->replaced_bytes;
  if (replaced < enforced_at_) late_bytes_ += enforced_at_ - replaced;
  LOCUS_DCHECK(entry == pinned_.begin() || std::prev(entry)->first.replaced_bytes <= replaced);
  LOCUS_DCHECK(std::next(entry) == pinned_.end() || replaced <= std::next(entry)->first.replaced_bytes);
  LOCUS_DCHECK_CALL(check_invariants());
  return entry;
}

void ReaderTracker::remove(SnapshotPin::Entry entry, const SnapshotPin::Revocation* revocation) {
  const MutexLock lock(mutex_);
  if (revocation != nullptr)
    revocations_.remove_if([revocation](const auto& other) { return other.get() == revocation; });
  LOCUS_DCHECK_GT(entry->second.pins, 0u);
  if (--entry->second.pins > 0) return;
  const bool revoked = entry->second.revoked;
  pinned_.erase(entry);
  LOCUS_DCHECK(!revoked || revoked_ > 0);
  if (revoked && --revoked_ == 0) returned_.notify_all();
  LOCUS_DCHECK_CALL(check_invariants());
}

void ReaderTracker::add_revocation(std::shared_ptr<SnapshotPin::Revocation> revocation) {
  const MutexLock lock(mutex_);
  revocations_.push_back(std::move(revocation));
}

bool ReaderTracker::may_exceed(const SceneSnapshot& latest) const {
  if (pinned_.empty() || pinned_.begin()->first >= SnapshotPin::Age::of(latest)) return false;
  LOCUS_DCHECK_GE(latest.replaced_bytes, counted_at_);
  LOCUS_DCHECK_GE(latest.replaced_bytes, pinned_.begin()->first.replaced_bytes);
  const uint64_t since_count = latest.replaced_bytes - counted_at_;
  const uint64_t since_oldest = latest.replaced_bytes - pinned_.begin()->first.replaced_bytes;
  return since_count >= budget_ / kCountShare && kMaxOfReplaced * since_oldest > budget_ &&
         counted_ + kMaxOfReplaced * (late_bytes_ + since_count) > budget_;
}

std::vector<ReaderTracker::Holding> ReaderTracker::pinned_before(const SceneSnapshot& latest) const {
  std::vector<Holding> pinned;
  for (auto entry = pinned_.begin(); entry != pinned_.lower_bound(SnapshotPin::Age::of(latest)); ++entry)
    if (SnapshotPtr snapshot = entry->second.snapshot.lock(); snapshot != nullptr)
      pinned.push_back({std::move(snapshot), 0});
  return pinned;
}

// Compares each pinned revision with the next pinned revision, and the last one with `latest`. Bytes that several
// consecutive pinned revisions share are therefore counted only once, for the last of these revisions.
uint64_t ReaderTracker::count(std::vector<Holding>& pinned, const SceneSnapshot& latest) {
  uint64_t held = 0;
  for (size_t i = 0; i < pinned.size(); ++i) {
    const SceneSnapshot& next = i + 1 < pinned.size() ? *pinned[i + 1].snapshot : latest;
    pinned[i].bytes = unshared_bytes(*pinned[i].snapshot, next);
    held += pinned[i].bytes;
  }
  return held;
}

void ReaderTracker::enforce_budget(const SceneSnapshot& latest) {
  std::vector<Holding> pinned;
  {
    const MutexLock lock(mutex_);
    LOCUS_DCHECK_LE(enforced_at_, latest.replaced_bytes);
    enforced_at_ = latest.replaced_bytes;
    if (!may_exceed(latest)) return;
    late_bytes_ = 0;
    pinned = pinned_before(latest);
  }
  uint64_t held = count(pinned, latest);
  // The budget may depend on the memory of the scene, which takes longer to measure than the held bytes. So the memory
  // of the scene is measured only if the held bytes exceed the smallest possible budget.
  const uint64_t budget = budget_for(held <= budget_for(0) ? 0 : bytes_of(latest));
  const MutexLock lock(mutex_);
  budget_ = budget;
  counted_at_ = latest.replaced_bytes;
  const uint64_t held_by_all = held;
  for (size_t i = 0; held > budget; ++i) {
    LOCUS_DCHECK_LT(i, pinned.size());
    revoke(*pinned[i].snapshot, held_by_all, budget);
    held -= pinned[i].bytes;
  }
  counted_ = held;
  LOCUS_DCHECK_CALL(check_invariants());
}

uint64_t ReaderTracker::revoke_beyond(const SceneSnapshot& latest, uint64_t bytes) {
  std::vector<Holding> pinned;
  {
    const MutexLock lock(mutex_);
    pinned = pinned_before(latest);
  }
  const uint64_t held = count(pinned, latest);
  uint64_t left = held;
  const MutexLock lock(mutex_);
  uint64_t revoked = 0;
  for (size_t i = 0; i < pinned.size() && left > bytes; ++i) {
    if (revoke(*pinned[i].snapshot, held, bytes)) revoked += pinned[i].bytes;
    left -= pinned[i].bytes;
  }
  LOCUS_DCHECK_CALL(check_invariants());
  return revoked;
}

bool ReaderTracker::revoke(const SceneSnapshot& snapshot, uint64_t held, uint64_t budget) {
  const auto entry = pinned_.find(SnapshotPin::Age::of(snapshot));
  if (entry == pinned_.end() || entry->second.revoked) return false;
  entry->second.budget = budget;
  entry->second.held = held;
  entry->second.revoked.store(true, std::memory_order_release);
  ++revoked_;
  LOCUS_DCHECK_LE(size_t{revoked_}, pinned_.size());
  return true;
}

bool ReaderTracker::over_budget() const {
  const MutexLock lock(mutex_);
  return revoked_ > 0 && !closed_;
}

uint64_t ReaderTracker::budget() const {
  const MutexLock lock(mutex_);
  return budget_;
}

bool ReaderTracker::wait_until_returned(Time until) const {
  const MutexLock lock(mutex_);
  while (revoked_ > 0 && !closed_) {
    if (until == kNever)
      returned_.wait(mutex_);
    else if (!returned_.wait_until(mutex_, until))
      return revoked_ == 0 || closed_;
  }
  return true;
}

void ReaderTracker::revoke_overdue() {
  const MutexLock lock(mutex_);
  for (const std::shared_ptr<SnapshotPin::Revocation>& revocation : revocations_)
    if (revocation->first->revoked) std::exchange(revocation->second, [] {})();
}

void ReaderTracker::close() {
  const MutexLock lock(mutex_);
  closed_ = true;
  returned_.notify_all();
}

ReaderTracker::Use ReaderTracker::use(const SceneSnapshot& latest, uint64_t latest_bytes) const {
  std::vector<Holding> pinned;
  {
    const MutexLock lock(mutex_);
    pinned = pinned_before(latest);
  }
  return {count(pinned, latest), budget_for(latest_bytes)};
}

}  // namespace locus
