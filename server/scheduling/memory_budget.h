// Enforces the memory limit of the process. Work that would exceed the limit is refused, so that the kernel does not
// kill the process, and with it all scenes. The budget counts the memory that the process holds (including messages,
// old revisions and the allocator's free memory) plus the bytes claimed by work in progress.
//
// Threads: every member may be called from any thread; the functions of the Meter are called by one thread at a time.
// Cost: the process is measured only when a claim does not seem to fit, or when the claims that ended since the last
// measurement exceed 1 / kStepShare of the limit. Invariant: claimed_ is the sum of the live claims.
#ifndef LOCUS_SERVER_SCHEDULING_MEMORY_BUDGET_H_
#define LOCUS_SERVER_SCHEDULING_MEMORY_BUDGET_H_

#include <cstdint>
#include <functional>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/base/mutex.h"

namespace locus::server {

class MemoryBudget {
 public:
  struct Meter {
    std::function<uint64_t()> used;        // returns the bytes that the process holds
    std::function<void()> release_memory;  // frees old revisions and returns free memory to the kernel; slow
  };

  // Claim of memory by work in progress; released when destroyed. Must not outlive the budget.
  class Claim {
   public:
    Claim(MemoryBudget* budget, uint64_t bytes) : budget_(budget), bytes_(bytes) {}
    Claim(Claim&& other) noexcept : budget_(std::exchange(other.budget_, nullptr)), bytes_(other.bytes_) {}
    Claim& operator=(Claim&&) = delete;
    ~Claim() {
      if (budget_ != nullptr) budget_->end(bytes_);
    }

   private:
    MemoryBudget* budget_;
    uint64_t bytes_;
  };

  MemoryBudget(uint64_t limit, Meter meter);

  // Claims `bytes`, the most memory that the work may add at any time. Returns RESOURCE_EXHAUSTED, naming `field` and
  // the limit memory_bytes, if that would exceed the limit even after release_memory().
  absl::StatusOr<Claim> claim(absl::string_view field, uint64_t bytes) LOCUS_EXCLUDES(mutex_);
  // Claims `bytes` for work that is never refused because it only changes existing objects. Now and then checks the
  // limit, and calls release_memory() if the claim would exceed it.
  Claim claim_anyway(uint64_t bytes) LOCUS_EXCLUDES(mutex_);

  uint64_t limit() const { return limit_; }
  // Returns the bytes that the process holds now.
  uint64_t used() const LOCUS_EXCLUDES(mutex_);

 private:
  // The process is measured again when claims of more than limit / kStepShare bytes have ended.
  static constexpr uint64_t kStepShare = 32;

  bool make_room(uint64_t bytes) LOCUS_REQUIRES(mutex_);
  bool fits(uint64_t bytes) const LOCUS_REQUIRES(mutex_);
  void measure() LOCUS_REQUIRES(mutex_);
  void end(uint64_t bytes) LOCUS_EXCLUDES(mutex_);

  const uint64_t limit_;
  const Meter meter_;
  mutable Mutex mutex_;
  uint64_t measured_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t ended_since_ LOCUS_GUARDED_BY(mutex_) = 0;  // bytes of claims that ended since the last measurement
  uint64_t claimed_ LOCUS_GUARDED_BY(mutex_) = 0;      // bytes claimed by work in progress
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_MEMORY_BUDGET_H_
