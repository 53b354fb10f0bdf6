// Enforces the memory limit of the process. Work that would exceed the limit is refused, so that the kernel does not
// kill the process, and with it all scenes. The budget counts the memory that the process uses (including messages in
// transit, old revisions, history and the allocator's free memory) plus the bytes claimed by work in progress. A claim
// is made before the memory exists.
//
// Each claim belongs to a line, which is the purpose of the memory. Lines have different ceilings, so that work that
// makes scenes grow is refused first, then updates, and queries last. Between the highest ceiling and the limit is a
// reserve for small claims of moves, requests and replies that do not fit below their ceilings. Each client may use a
// quarter of the reserve. So clients can usually still query and delete the data that fills the memory.
//
// Threads: every member may be called from any thread; the Meter is called by one thread at a time. No member frees
// memory, because freeing takes long. Instead, a refusal contains a retry delay, and the owner of the budget frees
// memory during the delay if take_shortage() returns true. Cost: a claim that fits takes no lock. The memory of the
// process is measured in three cases: refresh() is called, a claim does not seem to fit, or the claims that have ended
// since the last measurement add up to more than 1 / kStepShare of the limit. Invariants: claimed_ is the sum of the
// live claims; when claim() succeeds, either the measured memory plus the live claims are at most the ceiling of the
// line, or the claim uses the reserve, and all such claims fit into it.
#ifndef LOCUS_SERVER_SCHEDULING_MEMORY_BUDGET_H_
#define LOCUS_SERVER_SCHEDULING_MEMORY_BUDGET_H_

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/base/check.h"
#include "core/base/mutex.h"

namespace locus::server {

// Purpose of a claim, in the order in which claims are refused as memory runs short: those up to kInserts first, then
// kMoves, then kRequests and kReplies.
enum class MemoryLine : uint8_t {
  kUploads,   // columns of meshes that are uploaded
  kBuilds,    // trees of meshes and sets of instances that are built
  kDumps,     // dumps, downloads of meshes, and long lists
  kBackups,   // pieces of backups
  kInserts,   // update batches that insert objects
  kMoves,     // other update batches
  kRequests,  // parsed messages of callers
  kReplies,   // responses, until they are written to the network
};
inline constexpr size_t kMemoryLines = 8;
// Returns the line's name, such as "uploads".
absl::string_view memory_line_name(MemoryLine line);

class MemoryBudget {
  using Owner = std::optional<uint64_t>;  // client whose claim uses the reserve

 public:
  // Function that returns the bytes that the process uses.
  using Meter = std::function<uint64_t()>;

  // Claim of memory by work in progress; released when destroyed. An empty Claim claims nothing. Must not outlive the
  // budget.
  class Claim {
   public:
    Claim() = default;
    Claim(Claim&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)),
          line_(other.line_),
          reserve_owner_(other.reserve_owner_),
          bytes_(std::exchange(other.bytes_, 0)) {}
    Claim& operator=(Claim&& other) noexcept {
      std::swap(budget_, other.budget_);
      std::swap(line_, other.line_);
      std::swap(reserve_owner_, other.reserve_owner_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Claim() { release(); }

    uint64_t bytes() const { return bytes_; }
    // Reduces the claim to `bytes`, once the work knows that it needs no more. Does nothing if the claim is smaller.
    void shrink(uint64_t bytes) {
      if (budget_ == nullptr || bytes >= bytes_) return;
      budget_->end(line_, reserve_owner_, bytes_ - bytes);
      bytes_ = bytes;
    }
    void release() {
      if (budget_ != nullptr && bytes_ > 0) budget_->end(line_, reserve_owner_, std::exchange(bytes_, 0));
    }

   private:
    friend class MemoryBudget;
    Claim(MemoryBudget& budget, MemoryLine line, uint64_t bytes, Owner reserve_owner = std::nullopt)
        : budget_(&budget), line_(line), reserve_owner_(reserve_owner), bytes_(bytes) {}

    MemoryBudget* budget_ = nullptr;
    MemoryLine line_ = MemoryLine::kRequests;
    Owner reserve_owner_;
    uint64_t bytes_ = 0;
  };

  MemoryBudget(uint64_t limit, Meter meter);
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  // Claims `bytes`, the maximum memory that the work may add. Returns RESOURCE_EXHAUSTED, naming `field` and the limit
  // memory_bytes, if that would exceed the ceiling of `line`. The refusal has a delay after which to retry, unless
  // `bytes` alone exceed the ceiling. `owner` is the id of the client for which the work is done, such as
  // Caller::client().
  absl::StatusOr<Claim> claim(MemoryLine line, absl::string_view field, uint64_t bytes, uint64_t owner = 0)
      LOCUS_EXCLUDES(mutex_);
  // Claims `bytes` for work that is never refused, such as work that frees memory.
  Claim claim_anyway(MemoryLine line, uint64_t bytes) LOCUS_EXCLUDES(mutex_);

  // Measures the process. Call it periodically.
  void refresh() LOCUS_EXCLUDES(mutex_);
  // Returns whether, since the previous use of this function, a claim was refused that could succeed once memory is
  // freed.
  bool take_shortage() { return shortage_.exchange(false); }

  uint64_t limit() const { return limit_; }
  // Returns the largest sum of measured memory and claims at which claims of `line` succeed.
  uint64_t ceiling(MemoryLine line) const;
  // Returns the bytes that the process uses now.
  uint64_t used() const LOCUS_EXCLUDES(mutex_);
  // Returns an upper bound of the memory in use: the last measurement plus all claims whose memory may be missing from
  // it.
  uint64_t taken() const { return measured_.load() + ended_since_.load() + claimed_.load(); }
  // Returns the result of the last measurement.
  uint64_t measured() const { return measured_.load(); }
  // Returns the bytes that are claimed on `line`, and the number of claims of the line that were refused so far.
  uint64_t claimed(MemoryLine line) const { return lines_[static_cast<size_t>(line)].load(); }
  uint64_t refused(MemoryLine line) const { return refused_[static_cast<size_t>(line)].load(); }
  // Returns the largest sum of claims of moves, requests and replies that one connection, or one identity on all of its
  // connections, may hold. This is half of the memory that is left for claims, so that one client leaves memory for all
  // others.
  uint64_t connection_share() const;

 private:
  // The memory of the process is measured again once the claims that have ended since the last measurement add up to
  // more than limit / kStepShare bytes.
  static constexpr uint64_t kStepShare = 32;

  // Claims of at most this many bytes may use the reserve.
  static constexpr uint64_t kSmallClaim = 64u << 10;

  // Checks the sums of the reserve for the claims of `owner`. O(1). The other sums change without a lock.
  void check_invariants(uint64_t owner) const LOCUS_REQUIRES(mutex_);
  bool try_claim(MemoryLine line, uint64_t bytes);
  bool try_reserve(MemoryLine line, uint64_t bytes, uint64_t owner) LOCUS_REQUIRES(mutex_);
  uint64_t reserve() const;
  bool fits(MemoryLine line, uint64_t bytes) const;
  void measure() LOCUS_REQUIRES(mutex_);
  void end(MemoryLine line, Owner reserve_owner, uint64_t bytes);
  absl::Status refusal(MemoryLine line, absl::string_view field, uint64_t bytes);

  const uint64_t limit_;
  const Meter meter_;
  std::atomic<uint64_t> measured_{0};
  std::atomic<uint64_t> claimed_then_{0};  // claimed_ at the last measurement
  std::atomic<uint64_t> ended_since_{0};   // bytes of claims that ended since the last measurement
  std::atomic<uint64_t> claimed_{0};       // bytes claimed by work in progress
  std::array<std::atomic<uint64_t>, kMemoryLines> lines_{};
  std::array<std::atomic<uint64_t>, kMemoryLines> refused_{};
  std::atomic<bool> shortage_{false};
  mutable Mutex mutex_;
  // Bytes of the live claims that use the reserve, by owner; owners without such claims are absent.
  absl::flat_hash_map<uint64_t, uint64_t> reserved_ LOCUS_GUARDED_BY(mutex_);
  uint64_t reserved_in_all_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_MEMORY_BUDGET_H_
