// Memory that a call has claimed: from the budget of the process, from the share of it that one connection may hold,
// and from the quotas bytes_in_flight of the caller's identity and connection. Released when destroyed. An empty
// CallMemory claims nothing. May outlive the call, but not the server. One thread at a time.
#ifndef LOCUS_SERVER_RPC_CALL_MEMORY_H_
#define LOCUS_SERVER_RPC_CALL_MEMORY_H_

#include <cstdint>
#include <memory>
#include <utility>

#include "server/connections/connection.h"
#include "server/scheduling/memory_budget.h"
#include "server/security/quotas.h"

namespace locus::server {

class CallMemory {
 public:
  CallMemory() = default;
  // Combines a claim with the quotas that were taken for it, and with the connection whose claimed_bytes include it;
  // `connection` is null if no connection's claimed_bytes include the claim.
  CallMemory(MemoryBudget::Claim claim, QuotaHold quota, std::shared_ptr<Connection> connection)
      : claim_(std::move(claim)), quota_(std::move(quota)), connection_(std::move(connection)) {}
  CallMemory(CallMemory&&) noexcept = default;
  CallMemory& operator=(CallMemory&& other) noexcept {
    std::swap(claim_, other.claim_);
    std::swap(quota_, other.quota_);
    std::swap(connection_, other.connection_);
    return *this;
  }
  ~CallMemory() { release(); }

  uint64_t bytes() const { return claim_.bytes(); }
  // Reduces the claim to `bytes`, once the work knows that it needs no more. Does nothing if the claim is smaller.
  void shrink(uint64_t bytes) {
    if (connection_ != nullptr && bytes < claim_.bytes()) connection_->claimed_bytes.fetch_sub(claim_.bytes() - bytes);
    claim_.shrink(bytes);
    quota_.shrink(static_cast<double>(bytes));
  }
  void release() { shrink(0); }

 private:
  MemoryBudget::Claim claim_;
  QuotaHold quota_;
  std::shared_ptr<Connection> connection_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CALL_MEMORY_H_
