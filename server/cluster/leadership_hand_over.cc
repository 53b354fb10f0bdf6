// Hand-over of scenes to other members: on drain, and by move().
#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "server/cluster/leadership.h"

namespace locus::server {
namespace {

absl::Status stopped() { return absl::CancelledError("this daemon stops"); }

}  // namespace

void Leadership::move(SceneKey scene, MemberId to, MoveDone done) {
  {
    const MutexLock lock(mutex_);
    if (!ended_) moves_.push_back({scene, to, std::exchange(done, nullptr), false});
  }
  if (done) done(stopped());
  options_.wake();
}

void Leadership::end() {
  std::deque<Move> left;
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    left.swap(moves_);
  }
  for (const Move& move : left) {
    const bool running = hand_over_ && &move == &left.front();
    if (move.done)
      move.done(running ? absl::UnavailableError("the scene may have been moved: this daemon stops") : stopped());
  }
}

void Leadership::drain() {
  membership_.take_no_scenes();
  {
    const MutexLock lock(mutex_);
    draining_ = true;
  }
  options_.wake();
}

bool Leadership::drained() const {
  const MutexLock lock(mutex_);
  return drained_;
}

bool Leadership::draining() const {
  const MutexLock lock(mutex_);
  return draining_;
}

std::optional<Leadership::Move> Leadership::next_move() {
  const std::vector<SceneKey> led = led_.keys();
  const MutexLock lock(mutex_);
  if (moves_.empty() && draining_)
    for (const SceneKey scene : led) moves_.push_back({scene, 0, nullptr, true});
  if (moves_.empty()) return std::nullopt;
  return moves_.front();
}

void Leadership::finish_move(const Move& move, const absl::Status& status) {
  {
    const MutexLock lock(mutex_);
    moves_.pop_front();
  }
  if (move.done) move.done(status);
}

void Leadership::refuse_moves() {
  const size_t running = hand_over_ ? 1 : 0;  // the first one
  std::deque<Move> refused;
  {
    const MutexLock lock(mutex_);
    while (moves_.size() > running) {
      refused.push_front(std::move(moves_.back()));
      moves_.pop_back();
    }
  }
  for (const Move& move : refused)
    if (move.done) move.done(absl::NotFoundError("this daemon is not a member of the cluster at present"));
}

MemberId Leadership::target_of(const Move& move, absl::Span<const MemberId> followers) {
  if (!move.drains) return move.to;
  const MutexLock lock(mutex_);
  table_.remove(self_.id);
  if (const std::optional<MemberId> follower = table_.choose_of(followers)) return *follower;
  return table_.choose(options_.random, 0, 0).value_or(0);
}

bool Leadership::begin_hand_over() {
  const std::optional<Move> move = next_move();
  if (!move) return false;
  const bool drains = move->drains;
  if (!drains && move->to == 0) {
    finish_move(*move, absl::InvalidArgumentError("a scene is moved to a member, and 0 is none"));
    return true;
  }
  if (led_.find(move->scene) == nullptr) {
    finish_move(*move, absl::NotFoundError("this daemon does not lead the scene"));
    return true;
  }
  if (!drains && move->to == self_.id) {
    finish_move(*move, absl::OkStatus());
    return true;
  }
  const std::vector<MemberId> followers = host_.caught_up_followers(move->scene);
  if (!drains && !followers.empty() && std::find(followers.begin(), followers.end(), move->to) == followers.end()) {
    finish_move(*move, absl::FailedPreconditionError("the member is no follower that has all records of the scene"));
    return true;
  }
  if (!membership_.engine_answers()) {  // leading ends before the call, so it must be likely to succeed
    if (drains) return postpone();
    finish_move(*move, absl::UnavailableError("the engine of the cluster does not answer"));
    return true;
  }
  if (drains && !table_is_fresh()) {
    if (!read_table().ok()) postpone();
    return true;
  }
  const std::optional<Token> token = led_.take(move->scene);
  if (!token) return true;  // fenced just now
  host_.stop_leading(move->scene, *token, StopReason::kHandedOver);
  hand_over_ = HandOver{*move, *token, self_.id, target_of(*move, followers)};
  return true;
}

bool Leadership::hand_over() {
  if (!hand_over_) {
    if (!begin_hand_over()) return false;
    if (!hand_over_) return true;
  }
  const HandOver current = *hand_over_;
  const absl::StatusOr<LeaderRow> row = engine_.hand_over(current.move.scene, current.token, current.from, current.to);
  switch (row.status().code()) {
    case absl::StatusCode::kOk:
      host_.leader_changed(*row);
      break;
    case absl::StatusCode::kAborted:  // perhaps by an earlier attempt, whose outcome was unknown
    case absl::StatusCode::kNotFound:
      break;
    case absl::StatusCode::kFailedPrecondition:
      if (current.move.drains) {
        const MutexLock lock(mutex_);
        table_.remove(current.to);
        hand_over_->to = table_.choose(options_.random, self_.id, 0).value_or(0);
        return true;
      }
      break;
    default:
      return postpone();
  }
  hand_over_.reset();
  if (!row.ok()) reconcile_soon();  // leads on if the engine says so
  finish_move(current.move, row.status());
  return true;
}

bool Leadership::end_drain() {
  if (!draining() || drained()) return false;
  if (leaving_ == 0 && !self_.left) {
    if (self_.id == 0 && !hand_over_) return false;  // has not joined yet, or joins
    if (hand_over_ || led_.size() != 0) return false;
    if (!found_nothing_) {  // scenes may have been given to this member meanwhile
      reconcile_soon();
      return true;
    }
    leaving_ = membership_.leave();
  }
  if (leaving_ != 0 && !engine_.leave(leaving_).ok()) return postpone();
  const MutexLock lock(mutex_);
  drained_ = true;
  return true;
}

}  // namespace locus::server
