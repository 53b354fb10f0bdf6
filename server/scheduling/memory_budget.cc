#include "server/scheduling/memory_budget.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"

namespace locus::server {
namespace {

constexpr uint32_t kMemoryRetryMs = 200;
// Shares of the limit that a line leaves free for lines that are refused later: the lines up to kInserts leave 1/8, the
// line kMoves leaves 3/32.
constexpr uint64_t kShareKeptFromGrowth = 8;
constexpr uint64_t kShareKeptFromMoves = 32;
constexpr uint64_t kPartsKeptFromMoves = 3;

// Share of the limit that is the reserve for small claims, and the minimum and maximum size of the reserve in bytes.
// One owner may use 1 / kReserveOwners of the reserve.
constexpr uint64_t kReserveShare = 16;
constexpr uint64_t kMinReserve = 4u << 20;
constexpr uint64_t kMaxReserve = 64u << 20;
constexpr uint64_t kReserveOwners = 4;

constexpr std::array<absl::string_view, kMemoryLines> kLineNames = {"uploads", "builds", "dumps",    "backups",
                                                                    "inserts", "moves",  "requests", "replies"};

}  // namespace

absl::string_view memory_line_name(MemoryLine line) { return kLineNames[static_cast<size_t>(line)]; }

MemoryBudget::MemoryBudget(uint64_t limit, Meter meter) : limit_(limit), meter_(std::move(meter)) {
  MutexLock lock(mutex_);
  measure();
}

uint64_t MemoryBudget::ceiling(MemoryLine line) const {
  switch (line) {
    case MemoryLine::kUploads:
    case MemoryLine::kBuilds:
    case MemoryLine::kDumps:
    case MemoryLine::kBackups:
    case MemoryLine::kInserts:
      return limit_ - limit_ / kShareKeptFromGrowth;
    case MemoryLine::kMoves:
      return limit_ - kPartsKeptFromMoves * (limit_ / kShareKeptFromMoves);
    case MemoryLine::kRequests:
    case MemoryLine::kReplies:
      return limit_ - std::min(limit_ / kReserveShare, kMaxReserve);
  }
  return limit_;
}

// Measures the memory of the process. A claim that ends during the measurement is counted twice rather than not at all,
// because an overestimate is safe.
void MemoryBudget::measure() {
  const uint64_t ended = ended_since_.load();
  claimed_then_.store(claimed_.load());
  measured_.store(meter_());
  ended_since_.fetch_sub(ended);
}

// Returns whether a claim of `bytes` on `line` fits. Overestimates the memory in use, because memory that work in
// progress has already allocated is counted twice: as measured and as claimed.
bool MemoryBudget::fits(MemoryLine line, uint64_t bytes) const {
  const uint64_t sum = taken(), most = ceiling(line);
  return sum <= most && bytes <= most - sum;
}

// Adds the claim before the check, so that two concurrent claims cannot both take the last free bytes. Instead, both
// may fail.
bool MemoryBudget::try_claim(MemoryLine line, uint64_t bytes) {
  if (bytes > limit_) return false;
  claimed_.fetch_add(bytes);
  if (fits(line, 0)) {
    lines_[static_cast<size_t>(line)].fetch_add(bytes);
    return true;
  }
  claimed_.fetch_sub(bytes);
  return false;
}

// Subtracts from the measured memory the claims that existed at the last measurement, so that claims do not make the
// share smaller.
uint64_t MemoryBudget::connection_share() const {
  const uint64_t measured = measured_.load();
  const uint64_t unclaimed = measured - std::min(measured, claimed_then_.load());
  return std::max(limit_ - std::min(limit_, unclaimed), reserve()) / 2;
}

uint64_t MemoryBudget::reserve() const { return std::clamp(limit_ / kReserveShare, kMinReserve, kMaxReserve); }

// Claims `bytes` from the reserve if they fit into it. The reserve counts only the claims made by this function.
bool MemoryBudget::try_reserve(MemoryLine line, uint64_t bytes, uint64_t owner) {
  if (line < MemoryLine::kMoves || bytes > kSmallClaim) return false;
  const auto found = reserved_.find(owner);
  const uint64_t of_owner = bytes + (found == reserved_.end() ? 0 : found->second);
  if (reserved_in_all_ + bytes > reserve() || of_owner > reserve() / kReserveOwners) return false;
  if (bytes > 0) reserved_[owner] = of_owner;
  reserved_in_all_ += bytes;
  claimed_.fetch_add(bytes);
  lines_[static_cast<size_t>(line)].fetch_add(bytes);
  LOCUS_DCHECK_CALL(check_invariants(owner));
  return true;
}

absl::Status MemoryBudget::refusal(MemoryLine line, absl::string_view field, uint64_t bytes) {
  refused_[static_cast<size_t>(line)].fetch_add(1);
  const uint64_t sum = measured_.load() + claimed_.load(), most = ceiling(line);
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.field = std::string(field);
  refusal.limit = "memory_bytes";
  refusal.limit_value = static_cast<double>(limit_);
  refusal.asked = static_cast<double>(sum + bytes);
  if (bytes <= most) refusal.retry_after_ms = kMemoryRetryMs;
  return refuse(absl::StatusCode::kResourceExhausted,
                absl::StrCat("limit memory_bytes is ", limit_, ", of which ", sum, " are taken; this may need ", bytes,
                             " more, and ", memory_line_name(line), " may fill ", most,
                             ". Delete scenes or meshes, remove objects, send smaller batches, or start locusd ",
                             "with a larger --memory-limit"),
                refusal);
}

absl::StatusOr<MemoryBudget::Claim> MemoryBudget::claim(MemoryLine line, absl::string_view field, uint64_t bytes,
                                                        uint64_t owner) {
  if (ended_since_.load() <= limit_ / kStepShare && try_claim(line, bytes)) return Claim(*this, line, bytes);
  MutexLock lock(mutex_);
  if (ended_since_.load() > limit_ / kStepShare) measure();
  if (try_claim(line, bytes)) return Claim(*this, line, bytes);
  if (try_reserve(line, bytes, owner)) return Claim(*this, line, bytes, owner);
  if (bytes <= ceiling(line)) {
    measure();
    if (try_claim(line, bytes)) return Claim(*this, line, bytes);
    shortage_.store(true);
  }
  return refusal(line, field, bytes);
}

MemoryBudget::Claim MemoryBudget::claim_anyway(MemoryLine line, uint64_t bytes) {
  if (ended_since_.load() > limit_ / kStepShare) {
    MutexLock lock(mutex_);
    measure();
  }
  claimed_.fetch_add(bytes);
  lines_[static_cast<size_t>(line)].fetch_add(bytes);
  return Claim(*this, line, bytes);
}

void MemoryBudget::refresh() {
  MutexLock lock(mutex_);
  measure();
}

uint64_t MemoryBudget::used() const {
  MutexLock lock(mutex_);
  return meter_();
}

// Adds the bytes to ended_since_ before subtracting them from claimed_, so that taken() never misses them.
void MemoryBudget::end(MemoryLine line, Owner reserve_owner, uint64_t bytes) {
  LOCUS_DCHECK_LE(bytes, lines_[static_cast<size_t>(line)].load());
  ended_since_.fetch_add(bytes);
  lines_[static_cast<size_t>(line)].fetch_sub(bytes);
  claimed_.fetch_sub(bytes);
  if (!reserve_owner) return;
  MutexLock lock(mutex_);
  reserved_in_all_ -= bytes;
  const auto reserved = reserved_.find(*reserve_owner);
  LOCUS_DCHECK(reserved != reserved_.end());
  LOCUS_DCHECK_LE(bytes, reserved->second);
  if ((reserved->second -= bytes) == 0) reserved_.erase(reserved);
  LOCUS_DCHECK_CALL(check_invariants(*reserve_owner));
}

void MemoryBudget::check_invariants(uint64_t owner) const {
  LOCUS_CHECK_LE(reserved_in_all_, reserve());
  LOCUS_CHECK_EQ(reserved_.empty(), reserved_in_all_ == 0);
  const auto reserved = reserved_.find(owner);
  if (reserved == reserved_.end()) return;
  LOCUS_CHECK_LT(uint64_t{0}, reserved->second);
  LOCUS_CHECK_LE(reserved->second, reserved_in_all_);
  LOCUS_CHECK_LE(reserved->second, reserve() / kReserveOwners);
}

}  // namespace locus::server
