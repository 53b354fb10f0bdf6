// Counts the streams that gRPC keeps in memory for a connection, by gRPC's own statistics (channelz): those that the
// client has begun and that are not yet destroyed. gRPC 1.51 makes a stream for each HEADERS frame, before the server
// accepts its call, and keeps it after the client has reset it, without a limit. A client that resets each call at once
// makes about 130,000 calls a second, three times as many as the server accepts and ends, so only gRPC knows all of
// them.
//
// Threads: one thread at a time. A count takes about 15 us; the first count of a connection takes longer, because it
// asks for the numbers of all connections that gRPC has added since. Remove this class once gRPC limits the number of
// calls that wait to be accepted.
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

  // Returns the number of streams; nullopt if gRPC does not know the connection, such as before its handshake.
  std::optional<uint64_t> count(Connection& connection);

 private:
  // Asks gRPC for the numbers of connections that it has not been asked for yet, and stores them in the connections.
  void learn_numbers();

  ConnectionTable& table_;
  int64_t next_number_ = 0;  // numbers below were already asked for
  std::chrono::steady_clock::time_point ask_all_at_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_STREAM_COUNTER_H_
