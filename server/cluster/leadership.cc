// The step, the comparison with the engine's rows, and placement. Takeovers and hand-overs have files of their own.
#include "server/cluster/leadership.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/status/status.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::server {

Leadership::Leadership(ClusterEngine& engine, Membership& membership, ClusterHost& host, Options options)
    : engine_(engine), membership_(membership), host_(host), options_(std::move(options)) {}

ClusterTime Leadership::step() {
  adopt_member();
  deliver_stops();
  const ClusterTime now = options_.clock();
  const ClusterTime soon = now + options_.timing.beat;  // occasions that no thread reports are noticed by then
  if (now < retry_at_) return std::min(retry_at_, soon);
  if (self_.id == 0) {
    refuse_moves();
    return (hand_over_ && hand_over()) || end_drain() ? options_.clock() : soon;
  }
  if (mark_suspect() || hand_over() || reconcile() || end_drain() || take_followed() || give_estate() || sweep())
    return options_.clock();
  return std::max(now, std::min(soon, membership_.next_occasion(now)));
}

void Leadership::adopt_member() {
  Membership::Self self = membership_.self();
  if (self.lease != self_.lease) {
    led_.stop_all(StopReason::kDeclaredDead);
    known_assigned_ = 0;
    reconcile_at_ = ClusterTime::min();
    followed_.clear();
    estate_.reset();
  }
  if (self.left) led_.stop_all(StopReason::kDeclaredDead);
  self_ = std::move(self);
}

void Leadership::deliver(const std::vector<LedScenes::Stopped>& stops) {
  for (const LedScenes::Stopped& stopped : stops) host_.stop_leading(stopped.scene, stopped.token, stopped.reason);
}

void Leadership::begin(const LeaderRow& row) {
  LedScenes::Started started = led_.start(row, self_.lease);
  if (started.lease == nullptr) return;
  found_nothing_ = false;
  deliver(started.before);
  host_.start_leading({row, std::move(started.lease)});
}

bool Leadership::postpone() {
  retry_at_ = options_.clock() + options_.timing.retry;
  return true;
}

bool Leadership::reconcile() {
  bool due = self_.assigned > known_assigned_ || options_.clock() >= reconcile_at_;
  {
    const MutexLock lock(mutex_);
    due |= std::exchange(reconcile_soon_, false);
  }
  if (!due) return false;
  LOCUS_CHECK(!hand_over_);  // else the scene that is handed over would be led again
  const absl::StatusOr<std::vector<LeaderRow>> rows = engine_.scenes_led_by(self_.id);
  if (!rows.ok()) {
    reconcile_at_ = ClusterTime::min();
    return postpone();
  }
  known_assigned_ = std::max(known_assigned_, self_.assigned);
  reconcile_at_ = options_.clock() + options_.timing.reconcile;
  absl::flat_hash_set<SceneKey> present;
  for (const LeaderRow& row : *rows) {
    present.insert(row.key);
    begin(row);
  }
  for (const SceneKey scene : led_.keys()) {
    const std::shared_ptr<const SceneLease> lease = led_.find(scene);
    if (lease != nullptr && !present.contains(scene)) led_.stop(scene, lease->token(), StopReason::kFenced);
  }
  deliver_stops();
  found_nothing_ = rows->empty();
  return true;
}

absl::StatusOr<LeaderRow> Leadership::place(SceneKey scene) {
  constexpr int kAttempts = 4;  // each after the first because the chosen member had just died
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (!table_is_fresh()) RETURN_IF_ERROR(read_table());
    std::optional<MemberId> to;
    {
      const MutexLock lock(mutex_);
      to = table_.choose(options_.random, 0, 0);
      if (!to) table_.expire();
    }
    if (!to) return absl::UnavailableError("no member of the cluster takes scenes");
    absl::StatusOr<LeaderRow> row = engine_.take_over(scene, 0, *to);
    if (row.status().code() == absl::StatusCode::kFailedPrecondition) {
      const MutexLock lock(mutex_);
      table_.remove(*to);
      continue;
    }
    // Only the thread of step() begins to lead: what this thread has read may be past already.
    if (row.ok() && *to == membership_.self().id) reconcile_soon();
    return row;
  }
  return absl::UnavailableError("the members that were chosen for the scene have died");
}

bool Leadership::fenced(SceneKey scene, Token token) {
  if (!led_.stop(scene, token, StopReason::kFenced)) return false;
  options_.wake();
  return true;
}

void Leadership::reconcile_soon() {
  {
    const MutexLock lock(mutex_);
    reconcile_soon_ = true;
  }
  options_.wake();
}

bool Leadership::table_is_fresh() const {
  const MutexLock lock(mutex_);
  return table_.fresh(options_.clock(), options_.timing.table_age);
}

absl::Status Leadership::read_table() {
  ASSIGN_OR_RETURN(const std::vector<MemberRow> members, engine_.members());
  const ClusterTime now = options_.clock();
  const MutexLock lock(mutex_);
  table_.update(members, now);
  return absl::OkStatus();
}

}  // namespace locus::server
