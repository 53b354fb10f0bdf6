#include "server/rpc/call.h"

#include <algorithm>

#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/convert/status.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr const char* kSceneMetadata = "x-scene";
constexpr uint32_t kBusyRetryMs = 100;
// Interval at which a waiting thread checks whether its call has ended.
constexpr milliseconds kWaitSlice{50};
// Time that readers have to release a revoked snapshot before wait_for_readers() calls revoke_overdue_readers().
constexpr milliseconds kReadersMayTake{1000};
constexpr std::chrono::hours kNoDeadline{24 * 365};

SteadyTime to_steady(system_clock::time_point deadline) {
  const system_clock::time_point now = system_clock::now();
  if (deadline > now + kNoDeadline) return steady_clock::now() + kNoDeadline;
  return steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(deadline - now);
}

}  // namespace

uint64_t nanoseconds_since(SteadyTime start) {
  return static_cast<uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(steady_clock::now() - start).count());
}

Caller::Caller(const Host& host, const grpc::ServerContextBase& context, const std::atomic<bool>* gone)
    : host_(host), context_(context), gone_(gone), deadline_(to_steady(context.deadline())) {}

TraceContext Caller::trace() const {
  const auto& metadata = context_.client_metadata();
  const auto checked = [&metadata](const char* name, bool (*is_valid)(absl::string_view)) {
    const auto entry = metadata.find(name);
    if (entry == metadata.end()) return std::string();
    std::string value(entry->second.data(), entry->second.size());
    return is_valid(value) ? value : std::string();
  };
  TraceContext trace{checked(kRequestIdMetadata, is_request_id), checked("traceparent", is_traceparent)};
  if (trace.request_id.empty()) trace.request_id = request_id_of(number_);
  return trace;
}

absl::Status Caller::stop() const {
  if (host_.drain.ended()) return draining();
  if (steady_clock::now() >= deadline_) return absl::DeadlineExceededError("the call's deadline passed");
  if (gone_ != nullptr ? gone_->load() : context_.IsCancelled()) return absl::CancelledError("the caller gave up");
  return absl::OkStatus();
}

SteadyTime Caller::wait_until(bool stream) const {
  const SteadyTime now = steady_clock::now();
  const SteadyTime default_end = now + milliseconds(limits::kDefaultWaitMs);
  const bool without_deadline = deadline_ - now > kNoDeadline / 2;
  return stream || without_deadline ? std::min(default_end, deadline_) : deadline_;
}

absl::Status Caller::check_scene(const std::string& scene) const {
  const auto [begin, end] = context_.client_metadata().equal_range(kSceneMetadata);
  for (auto entry = begin; entry != end; ++entry)
    if (absl::string_view(entry->second.data(), entry->second.size()) != scene)
      return refuse_argument(Reason::kMalformed, kSceneMetadata, {},
                             "the metadata names another scene than the message; send the same name or leave it out");
  return absl::OkStatus();
}

absl::StatusOr<ScenePtr> find_scene(const Caller& caller, const std::string& name, absl::string_view field) {
  RETURN_IF_ERROR(check_scene_name(name, field));
  RETURN_IF_ERROR(caller.check_scene(name));
  return caller.host().registry.find_scene(name);
}

absl::StatusOr<SnapshotPin> wait_for(const Scene& scene, const View& view, SteadyTime until, const Caller& caller) {
  while (true) {
    const SteadyTime slice = std::min(until, steady_clock::now() + kWaitSlice);
    absl::StatusOr<SnapshotPin> snapshot = scene.pin(view, slice);
    if (snapshot.status().code() != absl::StatusCode::kDeadlineExceeded || slice == until) return snapshot;
    RETURN_IF_ERROR(caller.stop());
    if (caller.host().drain.draining()) return draining();
  }
}

absl::Status wait_for_readers(Scene& scene, const std::function<absl::Status()>& stop) {
  const SteadyTime start = steady_clock::now();
  while (true) {
    const SteadyTime now = steady_clock::now();
    absl::Status late = scene.wait_for_readers(now + kWaitSlice);
    if (late.ok()) return late;
    absl::Status stopped = stop();
    if (stopped.code() == absl::StatusCode::kDeadlineExceeded) return late;
    if (!stopped.ok()) return stopped;
    if (now - start > kReadersMayTake) scene.revoke_overdue_readers();
  }
}

absl::Status check_serving(const Host& host) {
  if (host.drain.draining()) return draining();
  return host.recovering.load() ? recovering() : absl::OkStatus();
}

grpc::Status serve(Host& host, grpc::ServerContextBase& context, Rpc rpc,
                   const std::function<absl::Status(const Caller&)>& body, WhileClosed while_closed) {
  const SteadyTime arrived = steady_clock::now();
  const Caller caller(host, context);
  const LogScope scope(caller.trace());
  context.AddTrailingMetadata(kRequestIdMetadata, LogScope::current().request_id);
  const AdmissionLimiter::Permit permit = host.calls.enter();
  absl::Status status;
  if (!permit) {
    status = refuse_full("", "calls", host.calls.max(), host.calls.max() + 1.0, kBusyRetryMs);
  } else if (absl::Status closed = check_serving(host); !closed.ok() && while_closed == WhileClosed::kRefuse) {
    status = std::move(closed);
  } else {
    status = body(caller);
  }
  record_answer(host.metrics, caller, rpc, status, arrived);
  return to_grpc(status);
}

bool ends_stream(const Caller& caller, const absl::Status& status) {
  if (status.code() == absl::StatusCode::kCancelled || status.code() == absl::StatusCode::kUnavailable) return true;
  return status.code() == absl::StatusCode::kDeadlineExceeded && !caller.stop().ok();
}

void record_answer(CallMetrics& metrics, const Caller& caller, Rpc rpc, const absl::Status& status,
                   SteadyTime arrived) {
  metrics.record_call(rpc, status.code(), nanoseconds_since(arrived));
  if (status.ok()) return;
  metrics.record_refusal(status);
  if (!logs(LogLevel::kDebug)) return;
  const LogScope scope(caller.trace());
  log(LogLevel::kDebug, "refused",
      {{"rpc", std::string(rpc_name(rpc))},
       {"code", absl::StatusCodeToString(status.code())},
       {"text", std::string(status.message())}});
}

}  // namespace locus::server
