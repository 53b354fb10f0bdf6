#include "server/services/health_service.h"

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

constexpr std::array kServices = {"", "locus.v1.ServerService", "locus.v1.SceneService", "locus.v1.UpdateService",
                                  "locus.v1.QueryService"};
// Interval at which a watcher's thread checks whether its call was cancelled.
constexpr std::chrono::milliseconds kCancellationPoll{100};
constexpr uint32_t kRetryAfterMs = 1000;

bool is_known(const std::string& service) {
  return std::find(kServices.begin(), kServices.end(), service) != kServices.end();
}

}  // namespace

HealthService::Response::ServingStatus HealthService::status_of(State state) {
  return state == State::kServing ? Response::SERVING : Response::NOT_SERVING;
}

grpc::Status HealthService::Check(grpc::ServerContext*, const Request* request, Response* response) {
  if (!is_known(request->service()))
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "there is no service of this name");
  response->set_status(status_of(state()));
  return grpc::Status::OK;
}

grpc::Status HealthService::Watch(grpc::ServerContext* context, const Request* request,
                                  grpc::ServerWriter<Response>* writer) {
  const AdmissionLimiter::Permit permit = host_.health_watchers.enter();
  if (!permit)
    return to_grpc(refuse_full("", "health_watchers", kMaxHealthWatchers, kMaxHealthWatchers + 1.0, kRetryAfterMs));
  const bool known = is_known(request->service());
  std::optional<Response::ServingStatus> sent;
  for (State now = state(); !context->IsCancelled(); now = wait(*context, now)) {
    Response response;
    response.set_status(known ? status_of(now) : Response::SERVICE_UNKNOWN);
    if (response.status() != sent && !writer->Write(response)) break;
    sent = response.status();
    if (now == State::kEnded) break;
  }
  return to_grpc(draining());
}

HealthService::State HealthService::wait(const grpc::ServerContext& context, State known) {
  const MutexLock lock(mutex_);
  while (state_ == known && !context.IsCancelled())
    changed_.wait_until(mutex_, std::chrono::steady_clock::now() + kCancellationPoll);
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
