// Limits the number of calls in progress: each call holds a Permit until it ends, and at most max() permits exist.
//
// Threads: every member may be called from any thread. Invariant: used() permits exist, and used() <= max().
#ifndef LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_
#define LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_

#include <chrono>
#include <cstdint>
#include <utility>

#include "core/base/check.h"
#include "core/base/mutex.h"

namespace locus::server {

class AdmissionLimiter {
 public:
  // Right to proceed; releases its place in the limiter when destroyed. Must not outlive the limiter.
  class Permit {
   public:
    Permit() = default;
    explicit Permit(AdmissionLimiter* limiter) : limiter_(limiter) {}
    Permit(Permit&& other) noexcept : limiter_(std::exchange(other.limiter_, nullptr)) {}
    Permit& operator=(Permit&& other) noexcept {
      std::swap(limiter_, other.limiter_);
      return *this;
    }
    ~Permit() {
      if (limiter_ != nullptr) limiter_->release();
    }
    // Returns false if the limiter was full.
    explicit operator bool() const { return limiter_ != nullptr; }

   private:
    AdmissionLimiter* limiter_ = nullptr;
  };

  explicit AdmissionLimiter(uint32_t max) : max_(max) {}

  // Returns a permit, which is empty if the limiter is full. Never waits.
  Permit enter() LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    if (used_ >= max_) return Permit();
    ++used_;
    check_invariants();
    return Permit(this);
  }

  uint32_t used() const LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    return used_;
  }
  uint32_t max() const { return max_; }

  // Waits until no permit is held; returns false if one still is at `deadline`.
  bool wait_until_empty(std::chrono::steady_clock::time_point deadline) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    while (used_ > 0)
      if (!emptied_.wait_until(mutex_, deadline)) return used_ == 0;
    return true;
  }

 private:
  void release() LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    LOCUS_DCHECK_LT(0u, used_);
    if (--used_ == 0) emptied_.notify_all();
    check_invariants();
  }
  void check_invariants() const LOCUS_REQUIRES(mutex_) { LOCUS_DCHECK_LE(used_, max_); }

  const uint32_t max_;
  mutable Mutex mutex_;
  ConditionVariable emptied_;
  uint32_t used_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_
