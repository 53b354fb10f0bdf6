#include "server/cluster/membership.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "core/base/planted_bug.h"

namespace locus::server {

Membership::Membership(ClusterEngine& engine, Options options)
    : engine_(engine), options_(std::move(options)), silence_(options_.timing) {
  options_.timing.check();
  const MutexLock lock(mutex_);
  begin_membership();
}

void Membership::begin_membership() {
  state_ = State::kJoining;
  id_ = 1 + options_.random() % kMaxMemberId;
  lease_ = std::make_shared<MemberLease>(options_.clock);
  assigned_ = 0;
  answers_ = false;
  silence_.clear();
  ring_ = Ring();
}

void Membership::end_membership() {
  if (!planted(PlantedBug::kDeadLeadsOn)) lease_->end();
  if (state_ == State::kLeft) return;
  if (takes_scenes_)
    begin_membership();
  else  // a daemon that drains does not join again
    state_ = State::kLeft;
}

ClusterTime Membership::step() {
  const uint64_t load = options_.load();
  MemberId id;
  State state;
  uint64_t told;
  {
    const MutexLock lock(mutex_);
    id = id_;
    state = state_;
    told = takes_scenes_ ? std::min(load, kTakesNoScenes - 1) : kTakesNoScenes;
  }
  switch (state) {
    case State::kLeft:
      return ClusterTime::max();
    case State::kJoining:
      return join(id, told);
    case State::kMember:
      return beat(id, told);
  }
  return ClusterTime::max();
}

ClusterTime Membership::join(MemberId id, uint64_t load) {
  const absl::Status joined = engine_.join(id, options_.info, load);
  const ClusterTime now = options_.clock();
  if (!joined.ok()) return now + options_.timing.retry;  // the same id again: the member may have been added
  const MutexLock lock(mutex_);
  if (state_ == State::kJoining) state_ = State::kMember;
  return now;
}

ClusterTime Membership::beat(MemberId id, uint64_t load) {
  const ClusterTime sent = options_.clock();
  size_t watched;
  {
    const MutexLock lock(mutex_);
    watched = std::min(kMaxWatched, kWatched + 2 * silence_.quiet(sent));
  }
  const absl::StatusOr<BeatReply> reply = engine_.beat(id, load, watched);
  const ClusterTime received = options_.clock();
  bool changed = false;
  ClusterTime next =
      sent + options_.timing.beat +
      ClusterTiming::Duration(options_.random() % (static_cast<uint64_t>(options_.timing.jitter.count()) + 1));
  {
    const MutexLock lock(mutex_);
    if (state_ != State::kMember) return ClusterTime::max();  // left meanwhile
    answers_ = reply.ok();
    if (reply.ok()) {
      changed = store(*reply, sent, received);
    } else if (reply.status().code() == absl::StatusCode::kNotFound) {
      end_membership();
      changed = true;
      next = received;
    } else {
      silence_.beat_failed();
    }
  }
  if (changed && options_.on_change) options_.on_change();
  return std::max(next, received);
}

bool Membership::store(const BeatReply& reply, ClusterTime sent, ClusterTime received) {
  const bool first = !lease_->living();
  lease_->extend((planted(PlantedBug::kLeaseFromAnswer) ? received : sent) + options_.timing.lease);
  silence_.beat_succeeded(received, reply.next);
  ring_.update(reply, sent, received);
  const bool assigned = std::exchange(assigned_, reply.assigned) != reply.assigned;
  return first || assigned || !reply.dead.empty();
}

Membership::Self Membership::self() const {
  const MutexLock lock(mutex_);
  return {state_ == State::kMember ? id_ : 0, lease_, assigned_, state_ == State::kLeft};
}

bool Membership::engine_answers() const {
  const MutexLock lock(mutex_);
  return answers_ && lease_->living();
}

void Membership::take_no_scenes() {
  const MutexLock lock(mutex_);
  takes_scenes_ = false;
}

MemberId Membership::leave() {
  const MutexLock lock(mutex_);
  lease_->end();
  const bool joined = std::exchange(state_, State::kLeft) == State::kMember;
  return joined ? id_ : 0;
}

std::optional<SeenBeat> Membership::suspect(ClusterTime now) const {
  const MutexLock lock(mutex_);
  return silence_.silent(now);
}

void Membership::suspect_answered(MemberId id, bool dead, ClusterTime now) {
  const MutexLock lock(mutex_);
  if (dead) {
    silence_.remove(id);
    ring_.add_dead(id, now);
  } else {
    silence_.restart(id, now);
  }
}

std::vector<MemberId> Membership::take_noticed_dead() {
  const MutexLock lock(mutex_);
  return ring_.take_noticed();
}

std::optional<MemberId> Membership::responsibility(ClusterTime now) const {
  const MutexLock lock(mutex_);
  return ring_.responsibility(id_, now - options_.timing.others_wait);
}

bool Membership::sweeps() const {
  const MutexLock lock(mutex_);
  return state_ == State::kMember && ring_.is_last(id_);
}

void Membership::forgotten(MemberId id) {
  const MutexLock lock(mutex_);
  ring_.remove_dead(id);
}

ClusterTime Membership::next_occasion(ClusterTime now) const {
  const MutexLock lock(mutex_);
  const ClusterTime noticed = ring_.first_noticed(id_);
  const ClusterTime duty = noticed == ClusterTime::max() ? noticed : noticed + options_.timing.others_wait;
  return std::min(silence_.next(now), duty);
}

}  // namespace locus::server
