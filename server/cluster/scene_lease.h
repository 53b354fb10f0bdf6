// Leases: until when this daemon may claim to lead its scenes. The lease of a member is extended by each of its beats
// and counted by its own monotonic clock from before the beat was sent. Others declare it dead only when they have seen
// the same beat for longer than a lease, so a member whose lease is living is the only one that leads its scenes. A
// process that was stopped and woken finds its lease expired.
//
// Check a lease right before a claim: after the snapshot of a linearizable query was taken, and before an update is
// acknowledged that the engine's fence does not judge.
//
// Threads: every member function may be called from any thread and takes no lock; MemberLease::extend() from one thread
// at a time. A check costs a few atomic loads and one reading of the clock. Invariants: a lease that was ended, or
// stopped, never becomes living again.
#ifndef LOCUS_SERVER_CLUSTER_SCENE_LEASE_H_
#define LOCUS_SERVER_CLUSTER_SCENE_LEASE_H_

#include <algorithm>
#include <atomic>
#include <memory>
#include <utility>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "server/cluster/cluster_engine.h"
#include "server/cluster/cluster_timing.h"

namespace locus::server {

class MemberLease {
 public:
  explicit MemberLease(ClusterClock clock) : clock_(std::move(clock)) {}

  // Returns true until the end of the last extension, unless end() was called.
  bool living() const { return !ended() && (planted(PlantedBug::kLeaseUnchecked) || clock_() < expires()); }
  bool ended() const { return ended_.load(std::memory_order_acquire); }
  ClusterTime expires() const { return ClusterTime(ClusterTime::duration(expires_.load(std::memory_order_acquire))); }

  // Moves the end of the lease to `expires`, if that is later.
  void extend(ClusterTime expires) {
    const auto count = expires.time_since_epoch().count();
    expires_.store(std::max(expires_.load(std::memory_order_relaxed), count), std::memory_order_release);
  }
  // Ends the lease for ever: the member is dead, or leaves.
  void end() { ended_.store(true, std::memory_order_release); }

 private:
  const ClusterClock clock_;
  std::atomic<ClusterTime::rep> expires_{ClusterTime::min().time_since_epoch().count()};
  std::atomic<bool> ended_{false};
};

// Right to lead one scene with one token, which only a raise changes: the leader itself made it higher, to fence a lost
// append of its own.
class SceneLease {
 public:
  enum class State : uint8_t {
    kLiving,   // this daemon leads the scene
    kExpired,  // the engine has not answered for too long: nothing may be claimed now, but the next beat may renew it
    kStopped,  // this daemon does not lead the scene any more
  };

  SceneLease(SceneKey scene, Token token, std::shared_ptr<const MemberLease> member)
      : scene_(scene), token_(token), member_(std::move(member)) {
    LOCUS_CHECK(member_ != nullptr);
  }

  SceneKey scene() const { return scene_; }
  Token token() const { return token_.load(std::memory_order_acquire); }
  const MemberLease& member() const { return *member_; }

  State state() const {
    if (stopped_.load(std::memory_order_acquire) || member_->ended()) return State::kStopped;
    return member_->living() ? State::kLiving : State::kExpired;
  }
  bool living() const { return state() == State::kLiving; }
  void stop() { stopped_.store(true, std::memory_order_release); }
  void raise(Token token) { token_.store(token, std::memory_order_release); }

 private:
  const SceneKey scene_;
  std::atomic<Token> token_;
  const std::shared_ptr<const MemberLease> member_;
  std::atomic<bool> stopped_{false};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_SCENE_LEASE_H_
