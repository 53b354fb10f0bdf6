#include "server/security/quotas.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

constexpr double kNanosecondsPerSecond = 1e9;
constexpr uint64_t kWindow = 1'000'000'000;   // minimum time in nanoseconds over which a mean is computed
constexpr size_t kEvictionLooks = 64;         // maximum number of accounts that evict_one() examines
constexpr uint32_t kFullTableRetryMs = 1000;  // within seconds, buckets refill and idle subjects can be removed
constexpr uint32_t kBytesRetryMs = 10;        // bytes in flight are released within milliseconds
constexpr double kMaxRetryMs = 3'600'000;

// Returns a number in full, as `1000000` rather than `1e+06`.
std::string in_full(double value) {
  constexpr double kExactIntegers = 9007199254740992.0;
  if (std::abs(value) <= kExactIntegers && value == std::trunc(value)) return absl::StrCat(static_cast<int64_t>(value));
  return absl::StrCat(value);
}

// Returns the capacity of a rate's bucket: the maximum that may be used in one burst.
double capacity_of(const Quota& quota, QuotaKind kind) { return quota.of(kind) * quota.burst_s; }

absl::Status refuse_quota(absl::string_view subject, QuotaKind kind, double limit, double asked,
                          absl::string_view detail, uint32_t retry_after_ms) {
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.limit = std::string(quota_name(kind));
  refusal.limit_value = limit;
  refusal.asked = asked;
  refusal.retry_after_ms = retry_after_ms;
  return refuse(absl::StatusCode::kResourceExhausted,
                absl::StrCat("quota ", quota_name(kind), " of ", subject, " is ", in_full(limit), ", asked for ",
                             in_full(asked), "; ", detail),
                refusal);
}

// Returns the error for a use of `asked` units of a rate whose bucket contains only `level` units.
absl::Status refuse_rate(absl::string_view subject, const Quota& quota, QuotaKind kind, double level, double asked) {
  const double rate = quota.of(kind);
  if (rate == 0) return refuse_quota(subject, kind, rate, asked, "nothing is allowed", 0);
  const double capacity = capacity_of(quota, kind);
  if (asked > capacity)
    return refuse_quota(subject, kind, rate, asked,
                        absl::StrCat("at most ", in_full(capacity), " may be asked for at once: send smaller batches"),
                        0);
  const double milliseconds = std::clamp(std::ceil((asked - level) / rate * 1000), 1.0, kMaxRetryMs);
  const auto retry = static_cast<uint32_t>(milliseconds);
  return refuse_quota(subject, kind, rate, asked, absl::StrCat("try again in ", retry, " ms"), retry);
}

// Returns advice for a caller that has used up its quota `kind`, which must not be a rate.
absl::string_view advice_for(QuotaKind kind, bool waiting_helps) {
  switch (kind) {
    case QuotaKind::kBytesInFlight:
      return waiting_helps ? "try again in 10 ms, and read your answers" : "send smaller messages, or ask for less";
    case QuotaKind::kOpenStreams:
      return "end a stream";
    case QuotaKind::kObjects:
      return "remove objects from the scenes that it created";
    case QuotaKind::kScenes:
      return "delete a scene that it created";
    case QuotaKind::kMeshBytes:
      return "delete meshes that it uploaded";
    case QuotaKind::kHistoryBytes:
      return "ask for fewer history_bytes, or delete a scene with a history that it created";
    case QuotaKind::kQueries:
    case QuotaKind::kWork:
    case QuotaKind::kUpdateItems:
      break;
  }
  return "use less";
}

absl::Status refuse_amount(absl::string_view subject, const Quota& quota, QuotaKind kind, double used, double asked) {
  const bool waiting_helps = kind == QuotaKind::kBytesInFlight && asked <= quota.of(kind);
  return refuse_quota(subject, kind, quota.of(kind), asked,
                      absl::StrCat(in_full(used), " are in use; ", advice_for(kind, waiting_helps)),
                      waiting_helps ? kBytesRetryMs : 0);
}

double seconds_between(uint64_t start, uint64_t end) {
  return end <= start ? 0 : static_cast<double>(end - start) / kNanosecondsPerSecond;
}

}  // namespace

Quotas::Quotas(QuotaOf quota_of, size_t max_subjects) : quota_of_(std::move(quota_of)), max_subjects_(max_subjects) {
  LOCUS_CHECK_LE(size_t{1}, max_subjects);
}

absl::Status Quotas::take(absl::string_view subject, QuotaKind kind, double amount, uint64_t now) {
  MutexLock lock(mutex_);
  return take_locked(subject, kind, amount, now, [] { return 0.0; });
}

absl::Status Quotas::take_each(absl::Span<const std::string> subjects, QuotaKind kind, double amount, uint64_t now) {
  MutexLock lock(mutex_);
  return take_each_locked(subjects, kind, amount, now, [] { return 0.0; });
}

absl::Status Quotas::take_each_locked(absl::Span<const std::string> subjects, QuotaKind kind, double amount,
                                      uint64_t now, Besides besides) {
  for (size_t i = 0; i < subjects.size(); ++i) {
    absl::Status status = take_locked(subjects[i], kind, amount, now, besides);
    if (status.ok()) continue;
    while (i-- > 0) put_back_locked(subjects[i], kind, amount);
    return status;
  }
  return absl::OkStatus();
}

absl::Status Quotas::take_locked(absl::string_view subject, QuotaKind kind, double amount, uint64_t now,
                                 Besides besides) {
  LOCUS_DCHECK_GE(amount, 0.0);
  Account* const account = this->account(subject, now);
  if (account == nullptr)
    return refuse_full("", "quota_subjects", static_cast<double>(max_subjects_), static_cast<double>(max_subjects_) + 1,
                       kFullTableRetryMs);
  if (is_rate(kind)) {
    Bucket& bucket = account->buckets[static_cast<size_t>(kind)];
    if (!(bucket.level >= amount)) return refuse_rate(subject, account->quota, kind, bucket.level, amount);
    bucket.level -= amount;
    bucket.window_used += amount;
  } else {
    double& taken = account->in_use[static_cast<size_t>(kind)];
    const double limit = account->quota.of(kind);
    const double used = limit == kNoQuota ? taken : taken + besides();
    if (!(used + amount <= limit)) return refuse_amount(subject, account->quota, kind, used, amount);
    taken += amount;
  }
  LOCUS_DCHECK_CALL(check_invariants(*account));
  return absl::OkStatus();
}

void Quotas::charge(absl::string_view subject, QuotaKind kind, double amount, uint64_t now) {
  LOCUS_DCHECK_GE(amount, 0.0);
  MutexLock lock(mutex_);
  Account* const account = this->account(subject, now);
  if (account == nullptr) return;
  if (is_rate(kind)) {
    account->buckets[static_cast<size_t>(kind)].level -= amount;
    account->buckets[static_cast<size_t>(kind)].window_used += amount;
  } else {
    account->in_use[static_cast<size_t>(kind)] += amount;
  }
  LOCUS_DCHECK_CALL(check_invariants(*account));
}

absl::StatusOr<QuotaHold> Quotas::hold(absl::Span<const std::string> subjects, QuotaKind kind, double amount,
                                       uint64_t now, Besides besides) {
  LOCUS_DCHECK(!is_rate(kind));
  MutexLock lock(mutex_);
  RETURN_IF_ERROR(take_each_locked(subjects, kind, amount, now, besides));
  return QuotaHold(*this, subjects, kind, amount);
}

QuotaHold Quotas::hold_anyway(absl::Span<const std::string> subjects, QuotaKind kind, double amount, uint64_t now) {
  for (const std::string& subject : subjects) charge(subject, kind, amount, now);
  return QuotaHold(*this, subjects, kind, amount);
}

void Quotas::give_back(absl::string_view subject, QuotaKind kind, double amount) {
  LOCUS_DCHECK(is_rate(kind));
  MutexLock lock(mutex_);
  put_back_locked(subject, kind, amount);
}

void Quotas::release(absl::string_view subject, QuotaKind kind, double amount) {
  LOCUS_DCHECK(!is_rate(kind));
  MutexLock lock(mutex_);
  put_back_locked(subject, kind, amount);
}

void Quotas::put_back_locked(absl::string_view subject, QuotaKind kind, double amount) {
  LOCUS_DCHECK_GE(amount, 0.0);
  const auto found = slots_.find(subject);
  if (found == slots_.end()) return;
  if (is_rate(kind)) {
    Account& account = accounts_[found->second];
    Bucket& bucket = account.buckets[static_cast<size_t>(kind)];
    // The bucket may have filled up since the amount was taken, or the quota may have become lower.
    bucket.level = std::min(capacity_of(account.quota, kind), bucket.level + amount);
    bucket.window_used = std::max(bucket.window_used - amount, 0.0);
  } else {
    double& used = accounts_[found->second].in_use[static_cast<size_t>(kind)];
    used = std::max(used - amount, 0.0);
  }
  LOCUS_DCHECK_CALL(check_invariants(accounts_[found->second]));
}

void Quotas::forget(absl::string_view subject) {
  MutexLock lock(mutex_);
  const auto found = slots_.find(subject);
  if (found != slots_.end()) remove(found->second);
}

std::vector<SubjectUse> Quotas::usage(uint64_t now) const {
  std::vector<SubjectUse> subjects;
  {
    MutexLock lock(mutex_);
    subjects.reserve(accounts_.size());
    const uint64_t generation = generation_.load(std::memory_order_relaxed);
    for (Account account : accounts_) {
      fill(account, now);
      if (account.generation != generation) adopt_quota(account, generation);
      subjects.push_back(uses_of(account));
    }
  }
  std::sort(subjects.begin(), subjects.end(),
            [](const SubjectUse& a, const SubjectUse& b) { return a.subject < b.subject; });
  return subjects;
}

SubjectUse Quotas::use_of(absl::string_view subject, uint64_t now) const {
  MutexLock lock(mutex_);
  const auto found = slots_.find(subject);
  Account account;
  account.subject = std::string(subject);
  if (found != slots_.end()) account = accounts_[found->second];
  fill(account, now);
  const uint64_t generation = generation_.load(std::memory_order_relaxed);
  if (account.generation != generation) adopt_quota(account, generation);
  return uses_of(account);
}

SubjectUse Quotas::uses_of(const Account& account) {
  SubjectUse use;
  use.subject = account.subject;
  for (size_t i = 0; i < kQuotaKinds; ++i) use.quotas[i] = use_of(account, static_cast<QuotaKind>(i));
  return use;
}

QuotaUse Quotas::use_of(const Account& account, QuotaKind kind) {
  const auto i = static_cast<size_t>(kind);
  QuotaUse use;
  use.limit = account.quota.limits[i];
  use.used = is_rate(kind) ? account.buckets[i].last_rate : account.in_use[i];
  use.available = is_rate(kind) ? account.buckets[i].level : use.limit - use.used;
  return use;
}

// Returns the account of a subject, after refilling its buckets for the time until `now` and adopting the current
// quota. If the subject has no account, adds one. Returns nullptr if the table is full and no account can be evicted.
Quotas::Account* Quotas::account(absl::string_view subject, uint64_t now) {
  const auto found = slots_.find(subject);
  Account* const account = found != slots_.end() ? &accounts_[found->second] : add(subject, now);
  if (account == nullptr) return nullptr;
  fill(*account, now);
  const uint64_t generation = generation_.load(std::memory_order_relaxed);
  if (account->generation != generation) adopt_quota(*account, generation);
  return account;
}

Quotas::Account* Quotas::add(absl::string_view subject, uint64_t now) {
  if (accounts_.size() >= max_subjects_ && !evict_one(now)) return nullptr;
  slots_.emplace(std::string(subject), accounts_.size());
  Account& account = accounts_.emplace_back();
  account.subject = std::string(subject);
  account.filled = now;
  for (Bucket& bucket : account.buckets) bucket.window_start = now;
  return &account;
}

// Removes the first idle account among the next kEvictionLooks accounts. Returns false if none of them is idle.
bool Quotas::evict_one(uint64_t now) {
  for (size_t looks = std::min(kEvictionLooks, accounts_.size()); looks > 0; --looks) {
    hand_ = (hand_ + 1) % accounts_.size();
    fill(accounts_[hand_], now);
    if (!is_idle(accounts_[hand_])) continue;
    remove(hand_);
    return true;
  }
  return false;
}

// Removes the account at `slot` and moves the last account there.
void Quotas::remove(size_t slot) {
  slots_.erase(accounts_[slot].subject);
  if (slot + 1 != accounts_.size()) {
    accounts_[slot] = std::move(accounts_.back());
    slots_[accounts_[slot].subject] = slot;
  }
  accounts_.pop_back();
}

// Fills the buckets for the time since they were filled last. Ends each window that is at least kWindow long and
// computes its mean rate.
void Quotas::fill(Account& account, uint64_t now) {
  const double elapsed = seconds_between(account.filled, now);
  account.filled = std::max(account.filled, now);
  for (size_t i = 0; i < kRates; ++i) {
    const auto kind = static_cast<QuotaKind>(i);
    Bucket& bucket = account.buckets[i];
    if (account.quota.limits[i] != kNoQuota)
      bucket.level = std::min(capacity_of(account.quota, kind), bucket.level + elapsed * account.quota.limits[i]);
    if (now < bucket.window_start + kWindow) continue;
    bucket.last_rate = bucket.window_used / seconds_between(bucket.window_start, now);
    bucket.window_used = 0;
    bucket.window_start = now;
  }
}

bool Quotas::is_idle(const Account& account) {
  for (size_t i = 0; i < kRates; ++i)
    if (account.buckets[i].level < capacity_of(account.quota, static_cast<QuotaKind>(i))) return false;
  return std::all_of(account.in_use.begin(), account.in_use.end(), [](double used) { return used == 0; });
}

// Reads the subject's quota again. The bucket of a rate that was unlimited until now begins full.
void Quotas::adopt_quota(Account& account, uint64_t generation) const {
  account.quota = quota_of_(account.subject);
  account.generation = generation;
  for (size_t i = 0; i < kRates; ++i) {
    const double capacity = capacity_of(account.quota, static_cast<QuotaKind>(i));
    double& level = account.buckets[i].level;
    // NOLINTNEXTLINE(bugprone-narrowing-conversions): clang-tidy 14 takes infinity for another type
    level = capacity == kNoQuota ? kNoQuota : std::min(level, capacity);
  }
}

void Quotas::check_invariants(const Account& account) {
  for (size_t i = 0; i < kQuotaKinds; ++i) LOCUS_CHECK_LE(0.0, account.in_use[i]);
  for (size_t i = 0; i < kRates; ++i)
    LOCUS_CHECK_LE(account.buckets[i].level, capacity_of(account.quota, static_cast<QuotaKind>(i)));
}

}  // namespace locus::server
