// The standard health service, grpc.health.v1.Health: reports whether the server, or one of its services, is serving.
// Load balancers, orchestrators and `locus health` use it.
//
// gRPC's own implementation is not used, because it adds completion queues with threads of their own. These threads
// also read from every connection and pass the messages on to the IO threads, which costs one wake-up for each message.
//
// Threads: every member may be called from any thread. Each watcher occupies a thread of the server; at most
// kMaxHealthWatchers watchers are admitted.
#ifndef LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_
#define LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_

#include <cstdint>
#include <vector>

#include "core/base/mutex.h"
#include "grpc/health/v1/health.pb.h"
#include "server/host/host.h"
#include "server/rpc/blocking_method.h"

namespace locus::server {

class HealthService {
 public:
  explicit HealthService(Host& host) : host_(host) {}

  // Returns the methods of the service, which use this object.
  std::vector<BlockingMethod> methods();

  void serving() { set(State::kServing); }
  void not_serving() { set(State::kNotServing); }
  // Ends every watcher's call soon.
  void end() { set(State::kEnded); }

 private:
  using Request = grpc::health::v1::HealthCheckRequest;
  using Response = grpc::health::v1::HealthCheckResponse;
  enum class State : uint8_t { kStarting, kServing, kNotServing, kEnded };

  absl::Status check(const Request& request, Response& response) const LOCUS_EXCLUDES(mutex_);
  absl::Status watch(const Caller& caller, const Request& request, MessageStream& stream) LOCUS_EXCLUDES(mutex_);
  static Response::ServingStatus status_of(State state);
  void set(State state) LOCUS_EXCLUDES(mutex_);
  State state() const LOCUS_EXCLUDES(mutex_);
  // Blocks until the state differs from `known`, the state is kEnded, or the caller gives up. Returns the state.
  State wait(const Caller& caller, State known) LOCUS_EXCLUDES(mutex_);

  Host& host_;
  mutable Mutex mutex_;
  ConditionVariable changed_;
  State state_ LOCUS_GUARDED_BY(mutex_) = State::kStarting;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_HEALTH_SERVICE_H_
