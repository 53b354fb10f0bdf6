// Counts what is in work and lets no more in than may be: admission of calls. A pass is held for as long as the work
// lasts.
//
// Threads: every member may be called from any thread. Invariant: never more passes than max().
#ifndef LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_
#define LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_

#include <chrono>
#include <cstdint>
#include <utility>

#include "core/base/mutex.h"

namespace locus::server {

class AdmissionLimiter {
 public:
  // Leaves the gate when dropped. Must not outlive it.
  class Permit {
   public:
    Permit() = default;
    explicit Permit(AdmissionLimiter* gate) : gate_(gate) {}
    Permit(Permit&& other) noexcept : gate_(std::exchange(other.gate_, nullptr)) {}
    Permit& operator=(Permit&& other) noexcept {
      std::swap(gate_, other.gate_);
      return *this;
    }
    ~Permit() {
      if (gate_ != nullptr) gate_->leave();
    }
    // False where there was no room.
    explicit operator bool() const { return gate_ != nullptr; }

   private:
    AdmissionLimiter* gate_ = nullptr;
  };

  explicit AdmissionLimiter(uint32_t max) : max_(max) {}

  // Never waits.
  Permit enter() LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    if (used_ >= max_) return Permit();
    ++used_;
    return Permit(this);
  }

  uint32_t used() const LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    return used_;
  }
  uint32_t max() const { return max_; }

  // Waits until nobody is inside; false when somebody still is at `deadline`.
  bool wait_until_empty(std::chrono::steady_clock::time_point deadline) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    while (used_ > 0)
      if (!emptied_.wait_until(mutex_, deadline)) return used_ == 0;
    return true;
  }

 private:
  void leave() LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    if (--used_ == 0) emptied_.notify_all();
  }

  const uint32_t max_;
  mutable Mutex mutex_;
  ConditionVariable emptied_;
  uint32_t used_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_ADMISSION_LIMITER_H_
