// Serves the methods that block: accepts their calls on an IO loop, admits each call before its first message is
// parsed, and runs its body on a thread of its own. Calls of unknown methods are refused with UNIMPLEMENTED.
//
// gRPC's synchronous services are not used: they parse a message before any of our code runs, so that a message of a
// few megabytes could use gigabytes of memory. Moreover, they answer malformed bytes with INTERNAL and an empty text.
//
// Threads: one thread calls add() and listen(), before the server serves. Calls arrive on IO loops.
#ifndef LOCUS_SERVER_RPC_BLOCKING_CALLS_H_
#define LOCUS_SERVER_RPC_BLOCKING_CALLS_H_

#include <grpcpp/generic/async_generic_service.h>

#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "server/rpc/blocking_method.h"
#include "server/rpc/io_threads.h"
#include "server/rpc/rpc_state.h"
#include "server/scheduling/call_threads.h"

namespace locus::server {

class BlockingCalls {
 public:
  // At most `max_threads` calls run at a time.
  BlockingCalls(RpcState& state, uint32_t max_threads) : state_(state), threads_(max_threads) {}

  void add(const BlockingMethod& method);
  void add(const std::vector<BlockingMethod>& methods);

  // Returns the service to register with gRPC's server. The server passes to this service every call that no other
  // service serves.
  grpc::AsyncGenericService& service() { return service_; }
  // Requests the first calls from gRPC. Call it once, after the server has started and before the IO threads start.
  void listen(IoThreads& threads);

 private:
  // NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): a call deletes itself
  class Call;

  // Returns the method of a path; null if there is none.
  const BlockingMethod* find(const std::string& path) const;

  RpcState& state_;
  grpc::AsyncGenericService service_;
  absl::flat_hash_map<std::string, BlockingMethod> methods_;
  CallThreads threads_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_BLOCKING_CALLS_H_
