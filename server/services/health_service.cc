#include "server/services/health_service.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <string>

#include "server/config/observability_limits.h"
#include "server/convert/status.h"

namespace locus::server {
namespace {

constexpr std::array kServices = {"", "locus.v1.ServerService", "locus.v1.SceneService", "locus.v1.UpdateService",
                                  "locus.v1.QueryService"};
// Interval at which a watcher's thread checks whether its call was cancelled.
constexpr std::chrono::milliseconds kCancellationPoll{100};

bool is_known(const std::string& service) {
  return std::find(kServices.begin(), kServices.end(), service) != kServices.end();
}

}  // namespace

HealthService::Response::ServingStatus HealthService::status_of(State state) {
  return state == State::kServing ? Response::SERVING : Response::NOT_SERVING;
}

std::vector<BlockingMethod> HealthService::methods() {
  BlockingMethod check_method;
  check_method.path = "/grpc.health.v1.Health/Check";
  check_method.limiter = &host_.health_checks;
  check_method.limit = "health_checks";
  check_method.while_closed = WhileClosed::kServe;
  check_method.body = unary_body<Request, Response>(
      [this](const Caller&, const Request& request, Response& response) { return check(request, response); });
  BlockingMethod watch_method;
  watch_method.path = "/grpc.health.v1.Health/Watch";
  watch_method.limiter = &host_.health_watchers;
  watch_method.limit = "health_watchers";
  watch_method.while_closed = WhileClosed::kServe;
  watch_method.body = streaming_body<Request>([this](const Caller& caller, const Request& request,
                                                     MessageStream& stream) { return watch(caller, request, stream); });
  return {check_method, watch_method};
}

absl::Status HealthService::check(const Request& request, Response& response) const {
  if (!is_known(request.service())) return absl::NotFoundError("there is no service of this name");
  const State now = state();
  // Calls are served from the moment when the recovery ends, which is before serving() is called.
  response.set_status(status_of(now == State::kStarting && !host_.recovering ? State::kServing : now));
  return absl::OkStatus();
}

absl::Status HealthService::watch(const Caller& caller, const Request& request, MessageStream& stream) {
  const bool known = is_known(request.service());
  std::optional<Response::ServingStatus> sent;
  State now = state();
  while (true) {
    Response response;
    response.set_status(known ? status_of(now) : Response::SERVICE_UNKNOWN);
    if (response.status() != sent && !stream.write(response)) break;
    sent = response.status();
    const State next = wait(caller, now);
    if (now == State::kEnded || next == now) break;  // the server ended, or the caller gave up
    now = next;
  }
  return draining();
}

HealthService::State HealthService::wait(const Caller& caller, State known) {
  const MutexLock lock(mutex_);
  while (state_ == known && state_ != State::kEnded && caller.stop().ok())
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
