// One call as the services see it: who calls, for how long, and whether it should still be answered. serve() is the
// frame around every call that is not a stream: admission, whether the server serves, the error map and the log.
//
// Threads: a Caller may be asked from any thread for as long as the call lasts.
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

// Of the steady clock, up to now.
uint64_t nanoseconds_since(SteadyTime moment);

class Caller {
 public:
  // `gone`, where given, says whether the caller gave up; of calls on completion queues, `context` does not.
  Caller(const Host& host, const grpc::ServerContextBase& context, const std::atomic<bool>* gone = nullptr);

  // OK while the call should go on; else CANCELLED, DEADLINE_EXCEEDED, or DRAINING once the grace is used up.
  absl::Status stop() const;

  // Far in the future for a call without a deadline.
  SteadyTime deadline() const { return deadline_; }
  // How long this call may wait for a revision: until its deadline, or limits::kDefaultWaitMs for a call without one.
  // On a stream that is the most for each message.
  SteadyTime wait_until(bool stream) const;

  // MALFORMED where the metadata `x-scene` is there and names another scene.
  absl::Status check_scene(const std::string& scene) const;

  // Ends the call at once, CANCELLED, whatever it waits for.
  void cancel() const { context_.TryCancel(); }

  // How logs call this call: by the caller's metadata x-request-id and traceparent where they are of their form, or by
  // an id of its own. Unlike the rest on the call's own thread only.
  TraceContext trace() const;

  const Host& host() const { return host_; }

 private:
  const Host& host_;
  const grpc::ServerContextBase& context_;
  const std::atomic<bool>* const gone_;
  SteadyTime deadline_;
  const uint64_t number_ = next_request_number();
};

// The metadata that brings a request id and takes it back to whoever called.
inline constexpr const char* kRequestIdMetadata = "x-request-id";

// The name and x-scene checks of a call about one scene, and the scene.
absl::StatusOr<ScenePtr> find_scene(const Caller& caller, const std::string& name, absl::string_view field);

// A hold on the snapshot that `view` names, waited for until `until`. Wakes up at once when it is published or the
// scene is deleted, and within a moment when the call ends or the server drains: then UNAVAILABLE, DRAINING.
absl::StatusOr<SnapshotPin> wait_for(const Scene& scene, const View& view, SteadyTime until, const Caller& caller);

// Waits while readers of the scene that were told to end have not; those that stay for long are cut off. Asks `stop`
// now and then, and ends with its status where that is not OK, or, at the call's deadline, with what it waited for.
absl::Status wait_for_readers(Scene& scene, const std::function<absl::Status()>& stop);

// UNAVAILABLE while the server reads back what it keeps, or drains.
absl::Status check_serving(const Host& host);
enum class WhileClosed { kRefuse, kServe };

// Runs `body`, turns what it returns into the call's status, and counts the call. Its lines in the log have its request
// id, which also goes back to the caller at the end.
grpc::Status serve(Host& host, grpc::ServerContextBase& context, Rpc rpc,
                   const std::function<absl::Status(const Caller&)>& body,
                   WhileClosed while_closed = WhileClosed::kRefuse);

// Which refusals of a message are the stream's own end: the caller's end of the call, and the server's.
bool ends_stream(const Caller& caller, const absl::Status& status);

// Counts a call or a message of a stream that was answered with `status`, and logs a line at debug where that is a
// refusal.
void record_answer(CallMetrics& metrics, const Caller& caller, Rpc rpc, const absl::Status& status, SteadyTime arrived);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CALL_H_
