#include "server/connections/connection_limiter.h"

#include <algorithm>

#include "core/base/check.h"

namespace locus::server {
namespace {

// The limiter forgets idle addresses only if it remembers at least this many addresses. See forget_idle().
constexpr size_t kManyAddresses = 1024;

}  // namespace

Admission ConnectionLimiter::admit(const std::string& key, Time now) {
  forget_idle(now);
  const auto [entry, added] = addresses_.try_emplace(key);
  Address& address = entry->second;
  if (added) {
    address.tokens = limits_.burst;
    address.updated = now;
  }
  refill(address, now);
  if (address.tokens < 1) return Admission::kTooFast;
  address.tokens -= 1;  // an attempt that is refused below counts, too
  if (connections_ >= limits_.connections) return Admission::kFull;
  if (address.connections >= limits_.connections_per_address) return Admission::kAddressFull;
  ++address.connections;
  ++connections_;
  LOCUS_DCHECK_CALL(check_invariants(address));
  return Admission::kAdmitted;
}

void ConnectionLimiter::leave(const std::string& key) {
  const auto found = addresses_.find(key);
  LOCUS_CHECK(found != addresses_.end());
  LOCUS_CHECK_LE(1u, found->second.connections);
  --found->second.connections;
  --connections_;
  LOCUS_DCHECK_CALL(check_invariants(found->second));
}

void ConnectionLimiter::charge(const std::string& key, uint32_t count) {
  const auto found = addresses_.find(key);
  if (found == addresses_.end()) return;
  found->second.tokens = std::max(found->second.tokens - count, -static_cast<double>(limits_.burst));
}

void ConnectionLimiter::refill(Address& address, Time now) const {
  const double seconds = std::chrono::duration<double>(std::max(now, address.updated) - address.updated).count();
  address.tokens = std::min<double>(limits_.burst, address.tokens + seconds * limits_.new_per_second);
  address.updated = std::max(now, address.updated);
}

void ConnectionLimiter::forget_idle(Time now) {
  if (addresses_.size() < std::max(kManyAddresses, cleanup_at_)) return;
  absl::erase_if(addresses_, [&](auto& entry) {
    refill(entry.second, now);
    return entry.second.connections == 0 && entry.second.tokens >= limits_.burst;
  });
  cleanup_at_ = 2 * addresses_.size();
}

void ConnectionLimiter::check_invariants(const Address& changed) const {
  LOCUS_CHECK_LE(changed.connections, limits_.connections_per_address);
  LOCUS_CHECK_LE(changed.connections, connections_);
  LOCUS_CHECK_LE(connections_, limits_.connections);
}

}  // namespace locus::server
