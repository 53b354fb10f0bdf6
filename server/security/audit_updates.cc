#include "server/security/audit_updates.h"

#include "absl/strings/str_cat.h"
#include "core/base/check.h"

namespace locus::server {
namespace {

constexpr int64_t kAuditedMs = 60'000;

}  // namespace

void AuditUpdates::count(const AuditedUpdate& update, int64_t unix_ms) {
  Sums early;
  {
    const MutexLock lock(mutex_);
    if (sums_.empty()) since_ms_ = unix_ms;
    std::pair<std::string, std::string> key(update.principal, update.scene);
    if (sums_.size() >= kMaxAuditedPairs && !sums_.contains(key)) {
      early.swap(sums_);
      since_ms_ = unix_ms;
    }
    Sum& sum = sums_[std::move(key)];
    if (sum.batches == 0) sum.first_ms = unix_ms;
    sum.peer.assign(update.peer.data(), update.peer.size());
    sum.rpc.assign(update.rpc.data(), update.rpc.size());
    sum.last_ms = unix_ms;
    ++sum.batches;
    sum.items += update.items;
    LOCUS_DCHECK_CALL(check_invariants());
  }
  write(early);
}

void AuditUpdates::check_invariants() const { LOCUS_CHECK_LE(sums_.size(), kMaxAuditedPairs); }

void AuditUpdates::tick(int64_t unix_ms) {
  Sums due;
  {
    const MutexLock lock(mutex_);
    // The counts are also due if the machine's clock was set back to a time before since_ms_.
    if (sums_.empty() || (unix_ms >= since_ms_ && unix_ms < since_ms_ + kAuditedMs)) return;
    due.swap(sums_);
  }
  write(due);
}

void AuditUpdates::write_all() {
  Sums all;
  {
    const MutexLock lock(mutex_);
    all.swap(sums_);
  }
  write(all);
}

void AuditUpdates::write(const Sums& sums) {
  for (const auto& [key, sum] : sums) {
    AuditEntry entry;
    entry.unix_ms = sum.last_ms;
    entry.principal = key.first;
    entry.peer = sum.peer;
    entry.rpc = sum.rpc;
    entry.subject = key.second;
    entry.text = absl::StrCat(sum.batches, " batches changed ", sum.items, " objects in ", sum.last_ms - sum.first_ms,
                              " ms; peer and rpc are those of the last");
    log_.write(std::move(entry));
  }
}

}  // namespace locus::server
