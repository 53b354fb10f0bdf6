// The standard health service, grpc.health.v1.Health: whether this server, or one of its services, serves. For load
// balancers, orchestrators and `locus health`.
//
// gRPC's own is not used: it brings completion queues of its own, whose threads then read from every connection and
// hand what came to the IO threads, at the price of a wake-up a message.
// Threads: every member may be called from any thread. A watcher keeps a thread of the server; there may be
// kMaxHealthWatchers.
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
  // No watcher is left soon after.
  void end() { set(State::kEnded); }

 private:
  // Of the protocol, as far as they are its numbers.
  enum class State : uint8_t { kServing = 1, kNotServing = 2, kServiceUnknown = 3, kEnded };

  // Requests and responses have one field each; Debian ships no schema of them, and any message is an Empty with
  // unknown fields.
  using Empty = google::protobuf::Empty;

  grpc::Status check(const Empty& request, Empty& response) const LOCUS_EXCLUDES(mutex_);
  grpc::Status watch(grpc::ServerContext& context, const Empty& request, grpc::ServerWriter<Empty>& writer)
      LOCUS_EXCLUDES(mutex_);
  static bool write(State state, grpc::ServerWriter<Empty>& writer);
  void set(State state) LOCUS_EXCLUDES(mutex_);
  State state() const LOCUS_EXCLUDES(mutex_);
  // Returns when it is no longer `known`, or `context` was given up.
  State wait(const grpc::ServerContext& context, State known) LOCUS_EXCLUDES(mutex_);

  Host& host_;
  mutable Mutex mutex_;
  ConditionVariable changed_;
  State state_ LOCUS_GUARDED_BY(mutex_) = State::kNotServing;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_
