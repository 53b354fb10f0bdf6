// Limits on connections: on their number in all, on their number from one address, and on the number of new connections
// that an address may open in a second. The limiter only decides; the acceptor closes refused connections.
//
// Threads: one thread at a time; the current time is an argument. Invariants, in check_invariants(): no address has
// more connections than there are in all, and no limit is exceeded.
#ifndef LOCUS_SERVER_CONNECTIONS_CONNECTION_LIMITER_H_
#define LOCUS_SERVER_CONNECTIONS_CONNECTION_LIMITER_H_

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/container/flat_hash_map.h"

namespace locus::server {

struct ConnectionLimits {
  uint32_t connections = 4096;              // maximum for all addresses together
  uint32_t connections_per_address = 1024;  // maximum for one address
  uint32_t new_per_second = 200;            // new connections a second from one address, on average
  uint32_t burst = 400;                     // new connections that an address may open in a burst
};

enum class Admission : uint8_t { kAdmitted, kFull, kAddressFull, kTooFast };

class ConnectionLimiter {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit ConnectionLimiter(const ConnectionLimits& limits) : limits_(limits) {}

  // Decides on a new connection of the address `key`, and counts it if it is admitted.
  Admission admit(const std::string& key, Time now);
  // Subtracts one ended connection from the number of connections of the address `key`.
  void leave(const std::string& key);

  // Takes `count` tokens from the address `key`, because a client at this address has misused a connection. A new
  // connection needs a token; tokens are refilled at the rate `new_per_second`. At most one burst of tokens can be
  // owed, so the address has its full burst again after at most twice the time in which a burst is refilled.
  void charge(const std::string& key, uint32_t count);

  // Returns the number of admitted connections.
  uint32_t connections() const { return connections_; }
  // Returns the number of addresses that are remembered.
  size_t addresses() const { return addresses_.size(); }

 private:
  struct Address {
    uint32_t connections = 0;
    double tokens = 0;  // new connections that may be opened now; negative after charge()
    Time updated;
  };

  void refill(Address& address, Time now) const;
  // If many addresses are remembered, forgets the addresses that have no connections and may open a full burst again.
  void forget_idle(Time now);
  void check_invariants(const Address& changed) const;

  const ConnectionLimits limits_;
  uint32_t connections_ = 0;
  size_t cleanup_at_ = 0;
  absl::flat_hash_map<std::string, Address> addresses_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_CONNECTION_LIMITER_H_
