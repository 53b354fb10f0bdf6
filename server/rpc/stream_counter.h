// Counts the streams that gRPC keeps in memory for a connection: the streams that the client has begun and that gRPC
// has not destroyed yet. The numbers come from gRPC's own statistics (channelz). gRPC 1.51 creates a stream for each
// HEADERS frame, before the server accepts the stream's call, and keeps the stream after the client has reset it. gRPC
// does not limit the number of such streams. A client that resets each call immediately makes about 130,000 calls a
// second, three times as many as the server accepts and ends, so the server's own count of calls misses most of them.
//
// Threads: one thread at a time. A count takes about 15 us. The first count of a connection takes longer, because the
// counter must first find the channelz id of the connection: it requests the ids of all connections that gRPC has added
// since its last request. Remove this class once gRPC limits the number of calls that wait to be accepted.
#ifndef LOCUS_SERVER_RPC_STREAM_COUNTER_H_
#define LOCUS_SERVER_RPC_STREAM_COUNTER_H_

#include <chrono>
#include <cstdint>
#include <optional>

#include "server/connections/connection.h"
#include "server/connections/connection_table.h"

namespace locus::server {

class StreamCounter {
 public:
  // `table` finds connections by the names that gRPC gives them. It must outlive the counter.
  explicit StreamCounter(ConnectionTable& table) : table_(table) {}

  // Returns the number of streams; nullopt if gRPC has not registered the connection yet, for example before its
  // handshake.
  std::optional<uint64_t> count(Connection& connection);

 private:
  // Asks gRPC for the channelz ids of connections from next_number_ on, and stores them in the connections. If
  // kAskAllInterval has passed since the last request for all ids, requests all ids again.
  void learn_numbers();

  ConnectionTable& table_;
  int64_t next_number_ = 0;  // all lower channelz ids were already asked for
  std::chrono::steady_clock::time_point ask_all_at_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_STREAM_COUNTER_H_
