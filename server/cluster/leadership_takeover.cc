// Takeover of scenes whose leader is dead, and placement of scenes that have none.
#include <utility>

#include "absl/status/status.h"
#include "server/cluster/leadership.h"

namespace locus::server {
namespace {

// Returns true if the engine did not answer, so that the call is to be repeated.
bool unanswered(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
    case absl::StatusCode::kAborted:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kFailedPrecondition:
      return false;
    default:
      return true;
  }
}

}  // namespace

bool Leadership::mark_suspect() {
  const std::optional<SeenBeat> suspect = membership_.suspect(options_.clock());
  if (!suspect) return false;
  const absl::StatusOr<bool> dead = engine_.mark_dead(*suspect);
  if (!dead.ok()) return postpone();
  membership_.suspect_answered(suspect->id, *dead, options_.clock());
  return true;
}

bool Leadership::take_followed() {
  for (const MemberId dead : membership_.take_noticed_dead())
    for (const ClusterHost::FollowedScene& scene : host_.followed_scenes(dead)) followed_.push_back(scene);
  if (draining()) followed_.clear();
  if (followed_.empty()) return false;
  const ClusterHost::FollowedScene scene = followed_.front();
  const absl::StatusOr<LeaderRow> row = engine_.take_over(scene.key, scene.token, self_.id);
  if (unanswered(row.status())) return postpone();
  followed_.pop_front();
  if (row.ok()) {
    ++known_assigned_;
    begin(*row);
  }
  return true;
}

bool Leadership::give_estate() {
  if (!estate_) {
    const std::optional<MemberId> dead = membership_.responsibility(options_.clock());
    if (!dead) return false;
    estate_ = Estate{*dead, false, {}};
  }
  if (!estate_->listed) {
    absl::StatusOr<std::vector<LeaderRow>> scenes = engine_.scenes_led_by(estate_->dead);
    if (!scenes.ok()) return postpone();
    estate_->scenes.assign(scenes->begin(), scenes->end());
    estate_->listed = true;
    return true;
  }
  if (!estate_->scenes.empty()) {
    give_first();
    return true;
  }
  const MemberId dead = estate_->dead;
  estate_.reset();
  if (dead == 0) return false;
  const absl::Status forgotten = engine_.forget(dead);
  if (forgotten.ok()) membership_.forgotten(dead);
  return unanswered(forgotten) ? postpone() : true;  // a member that leads scenes again is listed again
}

// Gives the first scene of the estate to a member.
void Leadership::give_first() {
  if (!table_is_fresh()) {
    if (!read_table().ok()) postpone();
    return;
  }
  const bool drains = draining();
  // The load of a scene is not known; assume that of a mean scene of this daemon.
  const uint64_t load = host_.load() / (led_.size() + 1);
  std::optional<MemberId> to;
  {
    const MutexLock lock(mutex_);
    to = table_.choose(options_.random, drains ? self_.id : 0, load);
    if (!to) table_.expire();
  }
  if (!to) {
    postpone();
    return;
  }
  const LeaderRow scene = estate_->scenes.front();
  const absl::StatusOr<LeaderRow> row = engine_.take_over(scene.key, scene.token, *to);
  if (unanswered(row.status())) {
    postpone();
    return;
  }
  if (row.status().code() == absl::StatusCode::kFailedPrecondition) {
    const MutexLock lock(mutex_);
    table_.remove(*to);
    return;
  }
  estate_->scenes.pop_front();
  if (!row.ok()) return;
  if (*to == self_.id) {
    ++known_assigned_;
    begin(*row);
  } else {
    host_.leader_changed(*row);
  }
}

bool Leadership::sweep() {
  const ClusterTime now = options_.clock();
  if (estate_ || now < sweep_at_ || !membership_.sweeps()) return false;
  const absl::StatusOr<std::vector<LeaderRow>> scenes = engine_.scenes_without_leader();
  if (!scenes.ok()) return postpone();
  sweep_at_ = now + options_.timing.sweep;
  if (scenes->empty()) return true;
  estate_ = Estate{0, true, {scenes->begin(), scenes->end()}};
  return true;
}

}  // namespace locus::server
