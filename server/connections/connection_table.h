// The connections of a server by the names of their peers, so that a call finds the connection that it came on.
//
// Threads: any; a lookup locks one of several parts for less than 100 ns. Invariant: a name has at most one accepted
// connection. The name of a unix connection contains its descriptor, which the kernel reuses after gRPC has closed it.
// gRPC closes it only when no call of the connection is left, so a call always finds its own connection.
#ifndef LOCUS_SERVER_CONNECTIONS_CONNECTION_TABLE_H_
#define LOCUS_SERVER_CONNECTIONS_CONNECTION_TABLE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "server/connections/connection.h"
#include "server/connections/connection_counters.h"

namespace locus::server {

class ConnectionTable {
 public:
  // Adds an accepted connection. Replaces an ended connection with the same name, if there is one.
  void add(std::shared_ptr<Connection> connection);
  // Removes the connection, unless another one has replaced it.
  void remove(const Connection& connection);

  // Returns the connection with this name. If none was accepted, as in servers whose connections gRPC accepts, returns
  // a stand-in Connection, which counts calls but cannot be closed. While one caller holds the stand-in of a name,
  // other callers get the same stand-in.
  std::shared_ptr<Connection> find(absl::string_view name);

  // Closes the connections that seem to use the most memory. The weight of a connection is the sum of two numbers: the
  // bytes that its calls have claimed, and the bytes outside of messages that it has received since the previous use of
  // this function. Closes connections whose weight is at least `min_bytes` and at least half of the largest weight. If
  // `close` is false, closes none and only records the received bytes for the next use. Returns the number of closed
  // connections. O(connections), with a system call for each; one thread at a time.
  size_t shed_heaviest(bool close, uint64_t min_bytes, const char* reason);

  // Closes the accepted connections for which `is_chosen` is true, without counting them as misused. Returns the number
  // of connections that were still open. O(connections).
  size_t close_if(const std::function<bool(const Connection&)>& is_chosen, const char* reason);

  // Returns the number of accepted connections.
  size_t size() const;

  // Returns the counts of all connections since the start.
  ConnectionCounters& counters() { return counters_; }
  const ConnectionCounters& counters() const { return counters_; }

 private:
  static constexpr size_t kParts = 16;
  static constexpr size_t kMinCleanup = 64;

  struct alignas(64) Part {
    mutable Mutex mutex;
    absl::flat_hash_map<std::string, std::shared_ptr<Connection>> accepted LOCUS_GUARDED_BY(mutex);
    absl::flat_hash_map<std::string, std::weak_ptr<Connection>> stand_ins LOCUS_GUARDED_BY(mutex);
    size_t cleanup_at LOCUS_GUARDED_BY(mutex) = kMinCleanup;
  };

  std::vector<std::shared_ptr<Connection>> accepted() const;
  Part& part_of(absl::string_view name);
  static std::shared_ptr<Connection> stand_in(Part& part, absl::string_view name) LOCUS_REQUIRES(part.mutex);

  std::array<Part, kParts> parts_;
  ConnectionCounters counters_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_CONNECTION_TABLE_H_
