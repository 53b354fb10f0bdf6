// How much memory the process may take, and whether a piece of work still fits: so that it is refused instead of the
// whole process being ended by the kernel, and every scene with it. What counts is what the process really holds
// (messages, old revisions and the allocator's spare parts included), plus what the work under way has claimed.
//
// Threads: every member may be called from any thread; `meter` is called by one at a time. Cheap: the process is
// measured only once the work admitted since the last time amounts to a share of the limit, or when it seems full.
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
    std::function<uint64_t()> used;   // bytes that the process holds
    std::function<void()> give_back;  // drops what can be dropped and hands free memory back to the kernel; slow
  };

  // Bytes claimed by work under way. Must not outlive the budget.
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

  // For work that may add `bytes` at its peak. RESOURCE_EXHAUSTED naming `field` and the limit memory_bytes where that
  // would pass the limit even after giving back.
  absl::StatusOr<Claim> claim(absl::string_view field, uint64_t bytes) LOCUS_EXCLUDES(mutex_);
  // For work that is never refused, since it only changes what is there; gives back where it would pass the limit.
  Claim claim_anyway(uint64_t bytes) LOCUS_EXCLUDES(mutex_);

  uint64_t limit() const { return limit_; }
  // What the process holds now.
  uint64_t used() const LOCUS_EXCLUDES(mutex_);

 private:
  // Of the limit: how much may be admitted between two measurements.
  static constexpr uint64_t kStepShare = 32;

  bool make_room(uint64_t bytes) LOCUS_REQUIRES(mutex_);
  bool fits(uint64_t bytes) const LOCUS_REQUIRES(mutex_);
  void measure() LOCUS_REQUIRES(mutex_);
  void end(uint64_t bytes) LOCUS_EXCLUDES(mutex_);

  const uint64_t limit_;
  const Meter meter_;
  mutable Mutex mutex_;
  uint64_t measured_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint64_t ended_since_ LOCUS_GUARDED_BY(mutex_) = 0;  // claims that ended since the last measurement
  uint64_t claimed_ LOCUS_GUARDED_BY(mutex_) = 0;      // by work under way
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_MEMORY_BUDGET_H_
