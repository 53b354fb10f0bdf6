#include "server/scheduling/memory_budget.h"

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/refusal.h"

namespace locus::server {

MemoryBudget::MemoryBudget(uint64_t limit, Meter meter) : limit_(limit), meter_(std::move(meter)) {
  MutexLock lock(mutex_);
  measure();
}

void MemoryBudget::measure() {
  measured_ = meter_.used();
  ended_since_ = 0;
}

// Returns whether `bytes` more fit within the limit. Overestimates the memory in use, because memory that work in
// progress has already allocated is counted twice: as measured and as claimed.
bool MemoryBudget::fits(uint64_t bytes) const {
  const uint64_t taken = measured_ + ended_since_ + claimed_;
  return taken <= limit_ && bytes <= limit_ - taken;
}

bool MemoryBudget::make_room(uint64_t bytes) {
  if (!fits(bytes) || ended_since_ > limit_ / kStepShare) measure();
  if (fits(bytes)) return true;
  // The work alone exceeds the limit, so releasing memory cannot help.
  if (bytes > limit_) return false;
  meter_.release_memory();
  measure();
  return fits(bytes);
}

absl::StatusOr<MemoryBudget::Claim> MemoryBudget::claim(absl::string_view field, uint64_t bytes) {
  MutexLock lock(mutex_);
  if (make_room(bytes)) {
    claimed_ += bytes;
    LOCUS_DCHECK_LE(measured_ + ended_since_ + claimed_, limit_);
    return Claim(this, bytes);
  }
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.field = std::string(field);
  refusal.limit = "memory_bytes";
  refusal.limit_value = static_cast<double>(limit_);
  refusal.asked = static_cast<double>(measured_ + claimed_ + bytes);
  return refuse(
      absl::StatusCode::kResourceExhausted,
      absl::StrCat("limit memory_bytes is ", limit_, ", of which ", measured_ + claimed_, " are taken; this may need ",
                   bytes, " more. Delete scenes or meshes, remove objects, send smaller batches, or start locusd ",
                   "with a larger --memory-limit"),
      refusal);
}

MemoryBudget::Claim MemoryBudget::claim_anyway(uint64_t bytes) {
  MutexLock lock(mutex_);
  // A claim of this kind is never refused, so memory is measured only after work of 1 / kStepShare of the limit ended.
  if (ended_since_ > limit_ / kStepShare) make_room(bytes);
  claimed_ += bytes;
  return Claim(this, bytes);
}

uint64_t MemoryBudget::used() const {
  MutexLock lock(mutex_);
  return meter_.used();
}

void MemoryBudget::end(uint64_t bytes) {
  MutexLock lock(mutex_);
  LOCUS_DCHECK_LE(bytes, claimed_);
  claimed_ -= bytes;
  ended_since_ += bytes;
}

}  // namespace locus::server
