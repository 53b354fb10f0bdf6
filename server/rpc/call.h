// One call as the services see it: its metadata, its deadline, and whether its caller still waits for an answer.
// serve() is the frame around every call on gRPC's synchronous threads: it admits the call, checks that the server is
// serving, converts the error, counts and logs.
//
// Threads: a Caller may be used from any thread while the call lasts, except trace().
#ifndef LOCUS_SERVER_RPC_CALL_H_
#define LOCUS_SERVER_RPC_CALL_H_

#include <grpcpp/server_context.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "core/scene/scene.h"
#include "server/host/host.h"
#include "server/observability/trace_context.h"

namespace locus::server {

using SteadyTime = std::chrono::steady_clock::time_point;

// Returns the nanoseconds from `start` to now on the steady clock.
uint64_t nanoseconds_since(SteadyTime start);

// The caller's side of one call. Refers to `context`, which must outlive it.
class Caller {
 public:
  // `gone`, if not null, becomes true when the caller gives up. Calls on completion queues must pass it, because
  // IsCancelled() of their `context` may not be called.
  Caller(const Host& host, const grpc::ServerContextBase& context, const std::atomic<bool>* gone = nullptr);

  // Returns OK while the call should continue; otherwise CANCELLED, DEADLINE_EXCEEDED, or UNAVAILABLE (DRAINING) when
  // the drain's grace period has passed.
  absl::Status stop() const;

  // Returns the call's deadline; a year from now for a call without one.
  SteadyTime deadline() const { return deadline_; }
  // Returns the time until which this call may wait for a revision: its deadline, or limits::kDefaultWaitMs from now if
  // it has none. A message of a stream waits until the deadline too, but never longer than limits::kDefaultWaitMs.
  SteadyTime wait_until(bool stream) const;

  // Returns INVALID_ARGUMENT (MALFORMED) if the metadata `x-scene` is present and names another scene.
  absl::Status check_scene(const std::string& scene) const;

  // Cancels the call at once, even while it is blocked in a read or write.
  void cancel() const { context_.TryCancel(); }

  // Returns the ids that name this call in logs: the caller's metadata x-request-id and traceparent if they are valid,
  // otherwise a generated request id. Call it on the call's own thread only.
  TraceContext trace() const;

  const Host& host() const { return host_; }

 private:
  const Host& host_;
  const grpc::ServerContextBase& context_;
  const std::atomic<bool>* const gone_;
  SteadyTime deadline_;
  const uint64_t number_ = next_request_number();
};

// Metadata key of the request id, in the caller's metadata and in the trailing metadata of the reply.
inline constexpr const char* kRequestIdMetadata = "x-request-id";

// Checks the scene's name and the metadata x-scene, then returns the scene. Errors name `field`.
absl::StatusOr<ScenePtr> find_scene(const Caller& caller, const std::string& name, absl::string_view field);

// Waits until `until` at most for the revision that `view` names, and pins its snapshot. Wakes up at once when the
// revision is published or the scene is deleted, and within 50 ms when the call ends or the server drains (then
// UNAVAILABLE, DRAINING).
absl::StatusOr<SnapshotPin> wait_for(const Scene& scene, const View& view, SteadyTime until, const Caller& caller);

// Waits until every reader whose snapshot of the scene was revoked has released it. Calls
// Scene::revoke_overdue_readers() repeatedly once that has taken longer than a second. Polls `stop` every 50 ms and
// returns its status if it is not OK; but instead of DEADLINE_EXCEEDED it returns the error of the scene, which names
// the limit pinned_bytes.
absl::Status wait_for_readers(Scene& scene, const std::function<absl::Status()>& stop);

// Returns UNAVAILABLE while the server recovers its scenes from the disk, or drains.
absl::Status check_serving(const Host& host);
// Treatment of a call that arrives while check_serving() fails.
enum class WhileClosed { kRefuse, kServe };

// Runs `body`, converts its status to the call's status, and counts the call. Log lines of the call carry its request
// id, which is also returned to the caller in the trailing metadata.
grpc::Status serve(Host& host, grpc::ServerContextBase& context, Rpc rpc,
                   const std::function<absl::Status(const Caller&)>& body,
                   WhileClosed while_closed = WhileClosed::kRefuse);

// Returns whether `status`, of a refused message, must end the whole stream: because the caller ended the call, its
// deadline passed, or the server drains.
bool ends_stream(const Caller& caller, const absl::Status& status);

// Counts a call, or one message of a stream, that was answered with `status`. Logs a line at debug level if `status` is
// not OK.
void record_answer(CallMetrics& metrics, const Caller& caller, Rpc rpc, const absl::Status& status, SteadyTime arrived);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CALL_H_
