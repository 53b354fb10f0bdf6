// The standard health service, grpc.health.v1.Health: reports whether the server, or one of its services, is serving.
// For load balancers, orchestrators and `locus health`.
//
// gRPC's own implementation is not used: it adds completion queues whose threads then read from every connection and
// pass the messages on to the IO threads, which costs a wake-up a message.
// Threads: every member may be called from any thread. Each watcher occupies a thread of the server; at most
// kMaxHealthWatchers are admitted.
#ifndef LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_
#define LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_

#include <cstdint>

#include "core/base/mutex.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "server/host/host.h"

namespace locus::server {

class HealthService final : public grpc::health::v1::Health::Service {
 public:
  explicit HealthService(Host& host) : host_(host) {}

  void serving() { set(State::kServing); }
  void not_serving() { set(State::kNotServing); }
  // Ends every watcher's call soon.
  void end() { set(State::kEnded); }

 private:
  using Request = grpc::health::v1::HealthCheckRequest;
  using Response = grpc::health::v1::HealthCheckResponse;
  enum class State : uint8_t { kServing, kNotServing, kEnded };

  grpc::Status Check(grpc::ServerContext* context, const Request* request, Response* response) override
      LOCUS_EXCLUDES(mutex_);
  grpc::Status Watch(grpc::ServerContext* context, const Request* request,
                     grpc::ServerWriter<Response>* writer) override LOCUS_EXCLUDES(mutex_);
  static Response::ServingStatus status_of(State state);
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
