// Counts of the connections of a server since its start, reported in metrics and in the list of limits. The acceptor
// and the code that closes connections increment them; any thread may read them. Plain atomic counters.
#ifndef LOCUS_SERVER_CONNECTIONS_CONNECTION_COUNTERS_H_
#define LOCUS_SERVER_CONNECTIONS_CONNECTION_COUNTERS_H_

#include <atomic>
#include <cstdint>

namespace locus::server {

struct ConnectionCounters {
  std::atomic<uint64_t> accepted{0};          // accepted by the kernel, including the refused connections
  std::atomic<uint64_t> refused_full{0};      // over the limit on all connections
  std::atomic<uint64_t> refused_address{0};   // over the limit of their address
  std::atomic<uint64_t> refused_too_fast{0};  // over the limit on new connections of their address
  std::atomic<uint64_t> refused_bytes{0};     // did not begin like a client of gRPC, or ended before that was known
  std::atomic<uint64_t> late{0};              // sent no complete first bytes in time
  std::atomic<uint64_t> idle{0};              // closed because they were idle for too long
  std::atomic<uint64_t> ended{0};             // ended after they were handed over to gRPC
  std::atomic<uint64_t> long_headers{0};      // connections without TLS, closed for a too long block of headers
  std::atomic<uint64_t> floods{0};  // closed for other floods; TLS connections count only if FloodGuard closed them
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_CONNECTION_COUNTERS_H_
