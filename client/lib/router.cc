#include "client/lib/router.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "client/lib/retry.h"
#include "client/lib/status.h"
#include "client/lib/writer.h"
#include "core/base/status_macros.h"
#include "grpcpp/channel.h"

namespace locus::client {
namespace {

// Calls of other servers in a row without a wait.
constexpr int kMaxHops = 8;
constexpr absl::Duration kReadersTimeout = absl::Milliseconds(500);

v1::Reason reason_of(const absl::Status& failure) {
  const std::optional<v1::Error> error = error_of(failure);
  return error ? error->reason() : v1::REASON_UNSPECIFIED;
}

// Returns whether no connection could be made, so that the request was not sent.
bool not_sent(const absl::Status& failure) {
  return absl::IsUnavailable(failure) && !refused_by_server(failure) &&
         (absl::StartsWith(failure.message(), "failed to connect to all addresses") ||
          absl::StartsWith(failure.message(), "DNS resolution failed"));
}

// Number of the token of a call whose token is not known, so that none is newer.
constexpr uint64_t kNoToken = std::numeric_limits<uint64_t>::max();

// Makes an attempt, and a second one if the server refuses the token and there is a newer one.
absl::Status attempt_at(const ServerLinks& server, absl::Time deadline, const Router::Attempt& attempt) {
  uint64_t token = kNoToken;
  absl::Status status = attempt(server, deadline, token);
  if (absl::IsUnauthenticated(status) && server.authorization->has_newer(token))
    status = attempt(server, deadline, token);
  return status;
}

std::vector<std::string> targets_of(const std::vector<std::shared_ptr<const ServerLinks>>& servers) {
  std::vector<std::string> targets;
  for (const auto& server : servers) targets.push_back(server->target);
  return targets;
}

}  // namespace

bool moves_to_other_server(const absl::Status& failure) {
  switch (reason_of(failure)) {
    case v1::REASON_ELSEWHERE:
    case v1::REASON_NO_LEADER:
    case v1::REASON_DRAINING:
    case v1::REASON_RECOVERING:
      return true;
    case v1::REASON_UNSPECIFIED:
      return absl::IsUnavailable(failure) || absl::IsCancelled(failure);
    default:
      return false;
  }
}

ServerLinks::ServerLinks(std::string with_target, std::shared_ptr<Authorization> with_authorization, Link with_latency,
                         Link with_bulk)
    : target(std::move(with_target)),
      authorization(std::move(with_authorization)),
      latency(std::move(with_latency)),
      bulk(std::move(with_bulk)),
      servers(v1::ServerService::NewStub(latency.channel)),
      scenes(v1::SceneService::NewStub(latency.channel)),
      updates(v1::UpdateService::NewStub(latency.channel)),
      queries(v1::QueryService::NewStub(latency.channel)),
      transfers(v1::SceneService::NewStub(bulk.channel)) {}

Reading::Reading(Routes& routes, absl::string_view scene, v1::View view, ReadFrom read_from)
    : routes_(&routes),
      scene_(scene),
      view_(std::move(view)),
      uses_floor_(view_.revision_case() == v1::View::REVISION_NOT_SET),
      leader_(view_.leader_only() || read_from == ReadFrom::kLeader) {}

v1::View Reading::next_view() {
  v1::View view = view_;
  const std::optional<Revision> floor = uses_floor_ ? routes_->floor(scene_) : std::nullopt;
  sent_floor_ = floor.has_value();
  if (floor) {
    view.set_at_least(floor->revision);
    view.set_epoch(floor->epoch);
  }
  if (leader_) view.set_leader_only(true);
  return view;
}

bool Reading::turns_to_leader(const absl::Status& failure) {
  if (reason_of(failure) == v1::REASON_SCENE_RESTARTED && sent_floor_) {
    uses_floor_ = false;
  } else if (leader_ || !absl::IsDeadlineExceeded(failure) || refused_by_server(failure)) {
    return false;
  }
  leader_ = true;
  return true;
}

Router::Router(std::shared_ptr<const ServerLinks> only) : given_({std::move(only)}) {}

Router::Router(std::vector<std::shared_ptr<const ServerLinks>> given, Open open, const ClusterOptions& options)
    : given_(std::move(given)),
      open_(std::move(open)),
      options_(options),
      routes_(std::make_unique<Routes>(targets_of(given_), [] { return absl::Now(); })) {}

std::string Router::address() const { return absl::StrJoin(targets_of(given_), ","); }

RetryPolicy Router::reconnection(const RetryPolicy& asked) const {
  return routes_ != nullptr && options_.retry.max_attempts > asked.max_attempts ? options_.retry : asked;
}

std::optional<Reading> Router::reading(absl::string_view scene, const v1::View& view) {
  if (routes_ == nullptr) return std::nullopt;
  return std::optional<Reading>(std::in_place, *routes_, scene, view, options_.read_from);
}

absl::Status Router::run(const CallPlan& plan, const Attempt& attempt, Reading* reading) {
  if (routes_ != nullptr) return run_in_cluster(plan, attempt, reading);
  const ServerLinks& server = *first();
  const absl::Time deadline = absl::Now() + plan.deadline;
  uint64_t token = kNoToken;
  bool lost = false;  // whether the outcome of an attempt is unknown
  const auto once = [&]() -> absl::Status {
    absl::Status status = attempt(server, deadline, token);
    lost = lost || (!status.ok() && !changed_nothing(status) && !absl::IsUnauthenticated(status));
    return status;
  };
  const auto wait = [&](absl::Duration duration) { wait_connecting(server.link_of(plan.lane), duration); };
  const auto attempts = [&] {
    return plan.repeat == Repeat::kNever ? once() : with_retries(plan.retry, deadline, once, wait);
  };
  absl::Status status = attempts();
  // Repeat even a call that is not safe to repeat: a server that refuses the token has changed nothing.
  if (absl::IsUnauthenticated(status) && server.authorization->has_newer(token)) status = attempts();
  return lost && plan.numbered_update && changed_nothing(status) ? outcome_unknown(status) : status;
}

absl::Status Router::run_in_cluster(const CallPlan& plan, const Attempt& attempt, Reading* reading) {
  const absl::string_view scene = plan.route.empty() ? plan.scene : plan.route;
  const absl::Time deadline = absl::Now() + plan.deadline;
  const uint64_t cancelled = running_.cancelled();
  Backoff backoff(options_.retry);
  bool lost = false;
  int hops = 0;
  const auto outcome = [&](const absl::Status& status) {
    return lost && plan.numbered_update && changed_nothing(status) ? outcome_unknown(status) : status;
  };
  while (true) {
    ASSIGN_OR_RETURN(const std::shared_ptr<const ServerLinks> server, server_for(scene, reading));
    // A follower may wait for the revision as long as the call may take: leave time to ask the leader.
    const bool may_turn = reading != nullptr && !reading->leader();
    const absl::Time until = may_turn ? absl::Now() + (deadline - absl::Now()) / 2 : deadline;
    const absl::Status status = attempt_at(*server, until, attempt);
    if (status.ok()) {
      routes_->answered(server->target);
      return status;
    }
    lost = lost || !(changed_nothing(status) || not_sent(status) || absl::IsUnauthenticated(status));
    if (running_.cancelled() != cancelled) return outcome(status);
    const bool follow = note(scene, server->target, status, reading);
    const absl::Time now = absl::Now();
    if (reading != nullptr && now < deadline && reading->turns_to_leader(status)) continue;
    const bool repeat = plan.repeat == Repeat::kWhenUnavailable;
    const bool moves = moves_to_other_server(status) && (repeat || refused_by_server(status) || not_sent(status));
    if (!moves && !(repeat && worth_repeating(status))) return outcome(status);
    if (reading != nullptr && reason_of(status) == v1::REASON_ELSEWHERE) reading->ask_leader();
    std::optional<absl::Duration> wait = absl::ZeroDuration();
    if (follow && hops < kMaxHops) {
      ++hops;
    } else {
      hops = 0;
      wait = backoff.after_failure(status);
    }
    if (!wait || now + *wait >= deadline) return outcome(gave_up(status));
    absl::SleepFor(*wait);
  }
}

absl::StatusOr<std::shared_ptr<const ServerLinks>> Router::server_for(absl::string_view scene, const Reading* reading) {
  if (routes_ == nullptr) return first();
  if (reading == nullptr || reading->leader()) return connected(routes_->next(scene));
  std::optional<std::string> reader = routes_->reader(scene);
  if (!reader) {
    choose_reader(scene);
    reader = routes_->reader(scene);
  }
  const bool usable = reader && !reader->empty() && routes_->would_answer(*reader);
  return connected(usable ? *reader : routes_->next(scene));
}

void Router::choose_reader(absl::string_view scene) {
  v1::GetSceneRequest request;
  request.set_name(std::string(scene));
  v1::GetSceneResponse response;
  CallPlan plan{kReadersTimeout, options_.retry, Repeat::kWhenUnavailable, scene};
  const absl::Status status = run(plan, [&](const ServerLinks& server, absl::Time until, uint64_t&) -> absl::Status {
    CancellableContext context(&running_);
    prepare(context, {*server.authorization, until, scene});
    response.Clear();
    return to_absl_status(server.scenes->GetScene(&context, request, &response));
  });
  const bool found = status.ok() && response.scene().has_placement();
  routes_->set_readers(scene, found ? &response.scene().placement() : nullptr, options_.read_from);
}

bool Router::note(absl::string_view scene, const std::string& target, const absl::Status& failure,
                  const Reading* reading) {
  if (routes_ == nullptr) return false;
  const v1::Reason reason = reason_of(failure);
  const bool reads = reading != nullptr && !reading->leader();
  if (reason == v1::REASON_ELSEWHERE) {
    routes_->answered(target);
    routes_->elsewhere(scene, target, *error_of(failure));
    if (reads) routes_->forget_readers(scene);
  } else if (reason == v1::REASON_NO_LEADER) {
    routes_->answered(target);
    routes_->has_no_leader(scene, target, retry_after(failure));
  } else if (reason == v1::REASON_NOT_FOUND) {
    routes_->forget_leader(scene);
  } else if (moves_to_other_server(failure)) {
    routes_->failed(target);
  }
  std::optional<std::string> following;
  if (reads && reason != v1::REASON_ELSEWHERE) following = routes_->reader(scene);
  if (!following || following->empty()) following = routes_->next(scene);
  return *following != target && routes_->would_answer(*following);
}

absl::Status Router::gave_up(const absl::Status& failure) const {
  if (routes_ == nullptr || !moves_to_other_server(failure)) return failure;
  absl::Status status(failure.code(),
                      absl::StrCat(failure.message(), "; tried at ", absl::StrJoin(routes_->all(), ", "),
                                   ": check that these servers run and that their PostgreSQL answers (GetServer shows "
                                   "both), or allow more time (ClusterOptions)"));
  failure.ForEachPayload([&](absl::string_view type, const absl::Cord& payload) { status.SetPayload(type, payload); });
  return status;
}

absl::StatusOr<std::shared_ptr<const ServerLinks>> Router::connected(const std::string& target) {
  const auto is_target = [&](const std::shared_ptr<const ServerLinks>& server) { return server->target == target; };
  if (const auto found = std::find_if(given_.begin(), given_.end(), is_target); found != given_.end()) return *found;
  const std::lock_guard lock(mutex_);
  if (const auto found = std::find_if(learned_.begin(), learned_.end(), is_target); found != learned_.end()) {
    learned_.splice(learned_.end(), learned_, found);
    return learned_.back();
  }
  ASSIGN_OR_RETURN(std::shared_ptr<const ServerLinks> opened, open_(target));
  if (learned_.size() >= kMaxConnections) learned_.pop_front();
  learned_.push_back(std::move(opened));
  return learned_.back();
}

}  // namespace locus::client
