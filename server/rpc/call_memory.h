// Memory that a call has claimed: from the budget of the process, from the shares of this budget that one connection
// and one identity may hold, and from the quotas bytes_in_flight of the caller's identity and connection. Released when
// destroyed. An empty CallMemory claims nothing. May outlive the call, but not the server. One thread at a time.
#ifndef LOCUS_SERVER_RPC_CALL_MEMORY_H_
#define LOCUS_SERVER_RPC_CALL_MEMORY_H_

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "server/connections/connection.h"
#include "server/scheduling/client_shares.h"
#include "server/scheduling/memory_budget.h"
#include "server/security/quotas.h"

namespace locus::server {

class CallMemory {
 public:
  CallMemory() = default;
  // Combines a claim with the quotas that were taken for it, and with the two counters of claimed bytes that include
  // the claim. These are Connection::claimed_bytes of `connection`, and `identity`, a counter of ClientShares.
  // `connection` and `identity` may be null.
  CallMemory(MemoryBudget::Claim claim, QuotaHold quota, std::shared_ptr<Connection> connection,
             std::shared_ptr<ClientShares::Counter> identity)
      : claim_(std::move(claim)),
        quota_(std::move(quota)),
        connection_(std::move(connection)),
        identity_(std::move(identity)) {}
  CallMemory(CallMemory&&) noexcept = default;
  CallMemory& operator=(CallMemory&& other) noexcept {
    std::swap(claim_, other.claim_);
    std::swap(quota_, other.quota_);
    std::swap(connection_, other.connection_);
    std::swap(identity_, other.identity_);
    return *this;
  }
  ~CallMemory() { release(); }

  uint64_t bytes() const { return claim_.bytes(); }
  // Reduces the claim to `bytes`, once the work knows that it needs no more. Does nothing if the claim is smaller.
  void shrink(uint64_t bytes) {
    const uint64_t freed = claim_.bytes() - std::min(claim_.bytes(), bytes);
    if (connection_ != nullptr) connection_->claimed_bytes.fetch_sub(freed);
    if (identity_ != nullptr) identity_->fetch_sub(freed);
    claim_.shrink(bytes);
    quota_.shrink(static_cast<double>(bytes));
  }
  void release() { shrink(0); }

 private:
  MemoryBudget::Claim claim_;
  QuotaHold quota_;
  std::shared_ptr<Connection> connection_;
  std::shared_ptr<ClientShares::Counter> identity_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CALL_MEMORY_H_
