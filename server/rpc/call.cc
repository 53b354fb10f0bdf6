#include "server/rpc/call.h"

#include <algorithm>
#include <functional>

#include "core/base/refusal.h"
#include "server/convert/status.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr const char* kSceneMetadata = "x-scene";
constexpr std::chrono::hours kNoDeadline{24 * 365};

// Returns the name of the caller's connection. gRPC has no name for channels within a process.
std::string peer_name(const grpc::ServerContextBase& context) {
  std::string name = context.peer();
  return name == "unknown" ? kInProcess : name;
}

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

Caller::Caller(RpcState& state, const grpc::ServerContextBase& context, const std::atomic<bool>& gone)
    : state_(state),
      context_(context),
      gone_(gone),
      connection_(state.connections.find(peer_name(context))),
      deadline_(to_steady(context.deadline())),
      client_(std::hash<std::string>{}(connection_->peer().name)) {}

void Caller::count_call() const {
  uint64_t bytes = 0;
  for (const auto& [name, value] : context_.client_metadata()) bytes += name.size() + value.size();
  connection_->call_begun(bytes);
}

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
  if (state_.drain.ended()) return draining();
  if (steady_clock::now() >= deadline_) return absl::DeadlineExceededError("the call's deadline passed");
  if (gone_.load()) return absl::CancelledError("the caller gave up");
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

absl::Status check_serving(const RpcState& state) {
  if (state.drain.draining()) return draining();
  return state.recovering.load() ? recovering() : absl::OkStatus();
}

bool ends_stream(const Caller& caller, const absl::Status& status) {
  if (status.code() == absl::StatusCode::kCancelled || status.code() == absl::StatusCode::kUnavailable) return true;
  if (status.code() != absl::StatusCode::kDeadlineExceeded) return false;
  const absl::Status stop = caller.stop();
  return !stop.ok() && !absl::IsUnavailable(stop);  // UNAVAILABLE: the server drains, and the caller waits for answers
}

void record_answer(CallMetrics& metrics, const Caller& caller, Rpc rpc, const absl::Status& status, SteadyTime arrived,
                   absl::string_view scene, bool is_change) {
  metrics.record_call(rpc, status.code(), nanoseconds_since(arrived));
  if (status.ok()) return;
  metrics.record_refusal(status);
  const bool is_hot = rpc >= Rpc::kApplyUpdates;  // blocking calls write their own lines
  if (is_hot && Caller::is_audited(status, is_change)) caller.audit(scene, status);
  if (!logs(LogLevel::kDebug)) return;
  const LogScope scope(caller.trace());
  log(LogLevel::kDebug, "refused",
      {{"rpc", std::string(rpc_name(rpc))},
       {"code", absl::StatusCodeToString(status.code())},
       {"text", std::string(status.message())}});
}

}  // namespace locus::server
