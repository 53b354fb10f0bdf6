// State that the calls of one server share: metrics, connections, limits of concurrent calls and of memory, and whether
// the server serves. Every member is thread-safe on its own.
#ifndef LOCUS_SERVER_RPC_RPC_STATE_H_
#define LOCUS_SERVER_RPC_RPC_STATE_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <utility>

#include "server/connections/connection_table.h"
#include "server/observability/metrics.h"
#include "server/scheduling/admission_limiter.h"
#include "server/scheduling/client_shares.h"
#include "server/scheduling/drain.h"
#include "server/scheduling/idle_scenes.h"
#include "server/scheduling/memory_budget.h"
#include "server/security/access_control.h"
#include "server/security/file_loads.h"
#include "server/security/quotas.h"

namespace locus::server {

struct RpcState {
  RpcState(uint32_t max_calls, uint32_t max_streams, uint64_t memory_limit, MemoryBudget::Meter meter)
      : calls(max_calls, Sharing::kFair),
        streams(max_streams, Sharing::kFair),
        memory(memory_limit, std::move(meter)) {}

  CallMetrics metrics;
  ConnectionTable connections;      // calls find the connection that they came on
  AdmissionLimiter calls;           // running calls that have no other limiter
  AdmissionLimiter streams;         // open streams of queries and updates
  MemoryBudget memory;              // memory limit of the process
  ClientShares shares;              // bytes of `memory` that each identity has claimed
  uint64_t max_inflated_bytes = 0;  // maximum size of an inflated message; 0 = gRPC refuses compressed messages
  // Identities and rights of callers. Set before the first call; null in servers without access control.
  AccessControl* access = nullptr;
  // Counts the open streams of each scene. Set before the first call; null in tests that serve no scenes.
  IdleScenes* idle_scenes = nullptr;
  FileLoads access_loads;  // loads of the access file, the token file and the JWKS file
  FileLoads tls_loads;     // loads of the certificate, its key and the client CA
  Quotas quotas{
      [this](absl::string_view subject) { return access == nullptr ? Quota() : access->rules()->quota_of(subject); }};
  Drain drain;
  // Maximum time that a call waits for its caller to read an answer, and that a blocking call waits for a message of
  // its caller. A call that waits longer is ended.
  std::chrono::milliseconds stall_limit = std::chrono::seconds(60);
  std::atomic<bool> recovering{false};  // true while the scenes of the log are being recovered
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_RPC_STATE_H_
