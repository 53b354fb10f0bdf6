// Limits the number of calls in progress: each call holds a Permit until it ends. Permits belong to owners, such as the
// identities or the connections of callers: one owner holds at most max() permits, and all owners together hold at most
// max_in_all().
//
// A fair limiter has a third more permits than one owner may hold. The additional permits are a reserve for owners that
// hold few permits: while max() or more permits are in use, only an owner that holds less than 1 / kSmallShare of the
// reserve gets another permit. So a single owner can hold max() permits, but does not shut others out while it keeps
// them.
//
// Threads: every member may be called from any thread. Invariants: used() permits exist, used() <= max_in_all(), and no
// owner holds more than max() permits.
#ifndef LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_
#define LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_

#include <chrono>
#include <cstdint>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/base/check.h"
#include "core/base/mutex.h"

namespace locus::server {

// Defines how owners share the permits of a limiter.
enum class Sharing : uint8_t {
  kFirstCome,  // max() permits in all, for whichever owner asks first
  kFair,       // max() permits for one owner, and a third more for owners that hold few
};

class AdmissionLimiter {
 public:
  // Right of one call to be in progress; the destructor releases it. Must not outlive the limiter.
  class Permit {
   public:
    Permit() = default;
    Permit(Permit&& other) noexcept : limiter_(std::exchange(other.limiter_, nullptr)), owner_(other.owner_) {}
    Permit& operator=(Permit&& other) noexcept {
      std::swap(limiter_, other.limiter_);
      std::swap(owner_, other.owner_);
      return *this;
    }
    ~Permit() {
      if (limiter_ != nullptr) limiter_->release(owner_);
    }
    // Returns whether this object holds a permit. enter() returns an empty Permit if the limiter is full.
    explicit operator bool() const { return limiter_ != nullptr; }

   private:
    friend class AdmissionLimiter;
    Permit(AdmissionLimiter& limiter, uint64_t owner) : limiter_(&limiter), owner_(owner) {}

    AdmissionLimiter* limiter_ = nullptr;
    uint64_t owner_ = 0;
  };

  explicit AdmissionLimiter(uint32_t max, Sharing sharing = Sharing::kFirstCome)
      : max_(max), reserve_(sharing == Sharing::kFair ? (max + 2) / 3 : 0) {}

  // Returns a permit for `owner`. The permit is empty if the limiter is full, or if the owner already holds its share.
  // Never waits.
  Permit enter(uint64_t owner = 0) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    const auto found = held_.find(owner);
    if (!admits(found == held_.end() ? 0 : found->second)) return Permit();
    ++used_;
    ++held_[owner];
    LOCUS_DCHECK_CALL(check_invariants());
    return Permit(*this, owner);
  }

  uint32_t used() const LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    return used_;
  }
  uint32_t max() const { return max_; }
  uint32_t max_in_all() const { return max_ + reserve_; }

  // Waits until no permit is held. Returns false if a permit is still held at `deadline`.
  bool wait_until_empty(std::chrono::steady_clock::time_point deadline) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    while (used_ > 0)
      if (!emptied_.wait_until(mutex_, deadline)) return used_ == 0;
    return true;
  }

 private:
  static constexpr uint32_t kSmallShare = 8;

  // Returns whether an owner that holds `held` permits may get another one.
  bool admits(uint32_t held) const LOCUS_REQUIRES(mutex_) {
    if (used_ < max_) return true;
    return used_ < max_in_all() && held < (reserve_ + kSmallShare - 1) / kSmallShare;
  }
  void release(uint64_t owner) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    const auto held = held_.find(owner);
    LOCUS_DCHECK(held != held_.end());
    if (--held->second == 0) held_.erase(held);
    if (--used_ == 0) emptied_.notify_all();
    LOCUS_DCHECK_CALL(check_invariants());
  }
  void check_invariants() const LOCUS_REQUIRES(mutex_) {
    uint32_t sum = 0;
    for (const auto& [owner, held] : held_) {
      LOCUS_CHECK_LE(held, max_);
      sum += held;
    }
    LOCUS_CHECK_EQ(sum, used_);
    LOCUS_CHECK_LE(used_, max_in_all());
  }

  const uint32_t max_;
  const uint32_t reserve_;
  mutable Mutex mutex_;
  ConditionVariable emptied_;
  uint32_t used_ LOCUS_GUARDED_BY(mutex_) = 0;
  absl::flat_hash_map<uint64_t, uint32_t> held_ LOCUS_GUARDED_BY(mutex_);  // permits of each owner that has any
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_
