// The standard health service, grpc.health.v1.Health: reports whether the server, or one of its services, is serving.
// For load balancers, orchestrators and `locus health`.
//
// gRPC's own implementation is not used: it adds completion queues whose threads then read from every connection and
// pass the messages on to the IO threads, which costs a wake-up a message.
// Threads: every member may be called from any thread. Each watcher occupies a thread of the server; at most
// kMaxHealthWatchers are admitted.
#ifndef LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_
#define LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/sync_stream.h>

#include <cstdint>

#include "core/base/mutex.h"
#include "google/protobuf/empty.pb.h"
#include "server/host/host.h"

namespace locus::server {

class HealthService final : public grpc::Service {
 public:
  explicit HealthService(Host& host);

  void serving() { set(State::kServing); }
  void not_serving() { set(State::kNotServing); }
  // Ends all watchers within 100 ms.
  void end() { set(State::kEnded); }

 private:
  // Values of HealthCheckResponse.ServingStatus, and kEnded, which is never sent.
  enum class State : uint8_t { kServing = 1, kNotServing = 2, kServiceUnknown = 3, kEnded };

  // Requests and responses have one field each. Debian ships no .proto file for them, so both are parsed as an Empty
  // with unknown fields.
  using Empty = google::protobuf::Empty;

  grpc::Status check(const Empty& request, Empty& response) const LOCUS_EXCLUDES(mutex_);
  grpc::Status watch(grpc::ServerContext& context, const Empty& request, grpc::ServerWriter<Empty>& writer)
      LOCUS_EXCLUDES(mutex_);
  static bool write(State state, grpc::ServerWriter<Empty>& writer);
  void set(State state) LOCUS_EXCLUDES(mutex_);
  State state() const LOCUS_EXCLUDES(mutex_);
  // Blocks until the state differs from `known` or the call of `context` is cancelled, and returns the state.
  State wait(const grpc::ServerContext& context, State known) LOCUS_EXCLUDES(mutex_);

  Host& host_;
  mutable Mutex mutex_;
  ConditionVariable changed_;
  State state_ LOCUS_GUARDED_BY(mutex_) = State::kNotServing;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_
