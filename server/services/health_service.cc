#include "server/services/health_service.h"

#include <google/protobuf/unknown_field_set.h>
#include <grpcpp/impl/codegen/method_handler.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/impl/codegen/rpc_service_method.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <string>

#include "core/base/refusal.h"
#include "server/config/observability_limits.h"
#include "server/convert/status.h"

namespace locus::server {
namespace {

constexpr int kServiceField = 1;  // HealthCheckRequest.service, string
constexpr int kStatusField = 1;   // HealthCheckResponse.status, enum
constexpr std::array kServices = {"", "locus.v1.ServerService", "locus.v1.SceneService", "locus.v1.UpdateService",
                                  "locus.v1.QueryService"};
// A watcher's thread checks this often whether its call was cancelled.
constexpr std::chrono::milliseconds kLookAgain{100};
constexpr uint32_t kRetryAfterMs = 1000;

std::string service_of(const google::protobuf::Empty& request) {
  const auto& fields = google::protobuf::Empty::GetReflection()->GetUnknownFields(request);
  std::string service;
  for (int i = 0; i < fields.field_count(); ++i) {
    const google::protobuf::UnknownField& field = fields.field(i);
    if (field.number() == kServiceField && field.type() == google::protobuf::UnknownField::TYPE_LENGTH_DELIMITED)
      service = field.length_delimited();
  }
  return service;
}

bool is_known(const std::string& service) {
  return std::find(kServices.begin(), kServices.end(), service) != kServices.end();
}

void set_status(uint64_t status, google::protobuf::Empty& response) {
  google::protobuf::Empty::GetReflection()->MutableUnknownFields(&response)->AddVarint(kStatusField, status);
}

}  // namespace

HealthService::HealthService(Host& host) : host_(host) {
  using grpc::internal::RpcMethod;
  using grpc::internal::RpcServiceMethod;
  AddMethod(new RpcServiceMethod("/grpc.health.v1.Health/Check", RpcMethod::NORMAL_RPC,
                                 new grpc::internal::RpcMethodHandler<HealthService, Empty, Empty>(
                                     [](HealthService* service, grpc::ServerContext*, const Empty* request,
                                        Empty* response) { return service->check(*request, *response); },
                                     this)));
  AddMethod(new RpcServiceMethod(
      "/grpc.health.v1.Health/Watch", RpcMethod::SERVER_STREAMING,
      new grpc::internal::ServerStreamingHandler<HealthService, Empty, Empty>(
          [](HealthService* service, grpc::ServerContext* context, const Empty* request,
             grpc::ServerWriter<Empty>* writer) { return service->watch(*context, *request, *writer); },
          this)));
}

grpc::Status HealthService::check(const Empty& request, Empty& response) const {
  if (!is_known(service_of(request)))
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "there is no service of this name");
  set_status(static_cast<uint64_t>(std::min(state(), State::kNotServing)), response);
  return grpc::Status::OK;
}

bool HealthService::write(State state, grpc::ServerWriter<Empty>& writer) {
  Empty response;
  set_status(static_cast<uint64_t>(state), response);
  return writer.Write(response);
}

grpc::Status HealthService::watch(grpc::ServerContext& context, const Empty& request,
                                  grpc::ServerWriter<Empty>& writer) {
  const AdmissionLimiter::Permit permit = host_.health_watchers.enter();
  if (!permit)
    return to_grpc(refuse_full("", "health_watchers", kMaxHealthWatchers, kMaxHealthWatchers + 1.0, kRetryAfterMs));
  const bool known = is_known(service_of(request));
  std::optional<State> sent;
  for (State now = state(); !context.IsCancelled(); now = wait(context, now)) {
    const State shown = known ? std::min(now, State::kNotServing) : State::kServiceUnknown;
    if (shown != sent && !write(shown, writer)) break;
    sent = shown;
    if (now == State::kEnded) break;
  }
  return to_grpc(draining());
}

HealthService::State HealthService::wait(const grpc::ServerContext& context, State known) {
  const MutexLock lock(mutex_);
  while (state_ == known && !context.IsCancelled())
    changed_.wait_until(mutex_, std::chrono::steady_clock::now() + kLookAgain);
  return state_;
}

void HealthService::set(State state) {
  const MutexLock lock(mutex_);
  state_ = state;
  changed_.notify_all();
}

HealthService::State HealthService::state() const {
  const MutexLock lock(mutex_);
  return state_;
}

}  // namespace locus::server
