// Counts the use of quotas by identities and connections, and refuses uses that exceed a quota. Rates are counted by
// token buckets, amounts by counters.
//
// A subject is the principal of an identity, or `connection:PEER`. Threads: every member may be called from any thread;
// calls take about 0.1 us under one mutex. Time is an argument, in nanoseconds of a steady clock. Subjects that use
// nothing are forgotten when the table is full. Invariant: no amount in use is negative.
#ifndef LOCUS_SERVER_SECURITY_QUOTAS_H_
#define LOCUS_SERVER_SECURITY_QUOTAS_H_

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/base/mutex.h"
#include "server/security/identity.h"
#include "server/security/quota.h"
#include "server/security/security_limits.h"

namespace locus::server {

// Use of one quota by one subject.
struct QuotaUse {
  // For a rate, the mean per second over the last second or more; for an amount, the amount in use now.
  double used = 0;
  double limit = kNoQuota;  // kNoQuota = unlimited
  double available = 0;     // amount that may be used immediately; negative = overdrawn
};
struct SubjectUse {
  std::string subject;
  std::array<QuotaUse, kQuotaKinds> quotas;
};

class QuotaHold;

class Quotas {
 public:
  // Function that returns the quota of a subject, for example AccessRules::quota_of(). Called with the mutex held: when
  // a subject is first seen, and at the subject's next use after refresh().
  using QuotaOf = std::function<Quota(absl::string_view subject)>;

  explicit Quotas(QuotaOf quota_of, size_t max_subjects = kMaxQuotaSubjects);

  // Takes `amount` from a quota. An amount in use must be released by release() later; an amount of a rate is used up.
  // If the quota does not suffice, returns RESOURCE_EXHAUSTED, naming the quota, its value, the amount, and when to try
  // again. With `amount` 0, only checks that the rate is not overdrawn.
  absl::Status take(absl::string_view subject, QuotaKind kind, double amount, uint64_t now) LOCUS_EXCLUDES(mutex_);
  absl::Status take(const Identity& identity, QuotaKind kind, double amount, uint64_t now) {
    return take(identity.principal, kind, amount, now);
  }
  // Takes `amount` from the quota of each subject or, if one quota does not suffice, from none.
  absl::Status take_each(absl::Span<const std::string> subjects, QuotaKind kind, double amount, uint64_t now)
      LOCUS_EXCLUDES(mutex_);
  // Function that returns how much of a quota is in use in addition to the amounts that were taken from this object.
  // Called with the mutex held.
  using Besides = absl::FunctionRef<double()>;
  // Takes `amount` from the quota of each subject and returns a hold that releases it when destroyed. If one quota does
  // not suffice, takes nothing and returns the error of take(). `kind` must not be a rate. The check adds the result of
  // `besides` to the amount that is already in use.
  absl::StatusOr<QuotaHold> hold(
      absl::Span<const std::string> subjects, QuotaKind kind, double amount, uint64_t now,
      Besides besides = [] { return 0.0; }) LOCUS_EXCLUDES(mutex_);
  // Takes the amount like hold(), but even if the quotas do not suffice.
  QuotaHold hold_anyway(absl::Span<const std::string> subjects, QuotaKind kind, double amount, uint64_t now)
      LOCUS_EXCLUDES(mutex_);

  // Takes `amount` even if the quota does not suffice, for work whose amount is known only after it was done. Later
  // calls of take() are refused until the rate has recovered, or enough of the amount in use was released. Counts
  // nothing if the subject is new and the table full.
  void charge(absl::string_view subject, QuotaKind kind, double amount, uint64_t now) LOCUS_EXCLUDES(mutex_);
  // Gives back `amount` of a rate that take() took, because the work was not done.
  void give_back(absl::string_view subject, QuotaKind kind, double amount) LOCUS_EXCLUDES(mutex_);
  // Releases an amount in use, so that it can be taken again. Not for rates.
  void release(absl::string_view subject, QuotaKind kind, double amount) LOCUS_EXCLUDES(mutex_);
  // Forgets a subject, for example a closed connection.
  void forget(absl::string_view subject) LOCUS_EXCLUDES(mutex_);

  // Makes the quota of each subject be read again at the subject's next use. Call it when the rules have changed.
  void refresh() { generation_.fetch_add(1, std::memory_order_relaxed); }
  // Return the use of all subjects, in ascending order of names, and the use of one subject, which may be unknown.
  std::vector<SubjectUse> usage(uint64_t now) const LOCUS_EXCLUDES(mutex_);
  SubjectUse use_of(absl::string_view subject, uint64_t now) const LOCUS_EXCLUDES(mutex_);

 private:
  static constexpr size_t kRates = 3;
  // One rate of a subject. `level` may be negative after charge().
  struct Bucket {
    double level = kNoQuota;
    double window_used = 0;  // taken since window_start
    double last_rate = 0;    // mean per second of the previous window
    uint64_t window_start = 0;
  };
  struct Account {
    std::string subject;
    Quota quota;
    uint64_t generation = 0;
    uint64_t filled = 0;  // time up to which the buckets are filled
    std::array<Bucket, kRates> buckets;
    std::array<double, kQuotaKinds> in_use{};  // amounts in use; 0 for rates
  };

  absl::Status take_locked(absl::string_view subject, QuotaKind kind, double amount, uint64_t now, Besides besides)
      LOCUS_REQUIRES(mutex_);
  absl::Status take_each_locked(absl::Span<const std::string> subjects, QuotaKind kind, double amount, uint64_t now,
                                Besides besides) LOCUS_REQUIRES(mutex_);
  void put_back_locked(absl::string_view subject, QuotaKind kind, double amount) LOCUS_REQUIRES(mutex_);
  Account* account(absl::string_view subject, uint64_t now) LOCUS_REQUIRES(mutex_);
  Account* add(absl::string_view subject, uint64_t now) LOCUS_REQUIRES(mutex_);
  bool evict_one(uint64_t now) LOCUS_REQUIRES(mutex_);
  void remove(size_t slot) LOCUS_REQUIRES(mutex_);
  static void fill(Account& account, uint64_t now);
  static bool is_idle(const Account& account);
  static SubjectUse uses_of(const Account& account);
  static QuotaUse use_of(const Account& account, QuotaKind kind);
  static void check_invariants(const Account& account);
  void adopt_quota(Account& account, uint64_t generation) const LOCUS_REQUIRES(mutex_);

  const QuotaOf quota_of_;
  const size_t max_subjects_;
  std::atomic<uint64_t> generation_{1};
  mutable Mutex mutex_;
  std::vector<Account> accounts_ LOCUS_GUARDED_BY(mutex_);
  absl::flat_hash_map<std::string, size_t> slots_ LOCUS_GUARDED_BY(mutex_);  // positions in accounts_
  size_t hand_ LOCUS_GUARDED_BY(mutex_) = 0;  // account after which the next eviction begins its search
};

// Amount of a quota that subjects have in use; the destructor releases it. An empty hold has taken nothing. Must not
// outlive the Quotas. One thread at a time.
class QuotaHold {
 public:
  QuotaHold() = default;
  QuotaHold(QuotaHold&& other) noexcept { *this = std::move(other); }
  QuotaHold& operator=(QuotaHold&& other) noexcept {
    std::swap(quotas_, other.quotas_);
    std::swap(subjects_, other.subjects_);
    std::swap(kind_, other.kind_);
    std::swap(amount_, other.amount_);
    return *this;
  }
  ~QuotaHold() { shrink(0); }

  // Reduces the amount to `amount`. Does nothing if the hold has less.
  void shrink(double amount) {
    if (quotas_ == nullptr || amount >= amount_) return;
    for (const std::string& subject : subjects_) quotas_->release(subject, kind_, amount_ - amount);
    amount_ = amount;
  }

 private:
  friend class Quotas;
  QuotaHold(Quotas& quotas, absl::Span<const std::string> subjects, QuotaKind kind, double amount)
      : quotas_(&quotas), subjects_(subjects.begin(), subjects.end()), kind_(kind), amount_(amount) {}

  Quotas* quotas_ = nullptr;
  std::vector<std::string> subjects_;
  QuotaKind kind_ = QuotaKind::kBytesInFlight;
  double amount_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_QUOTAS_H_
