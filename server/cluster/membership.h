// This daemon's membership in the cluster: joins, beats each second, extends the lease of the member, and finds out
// which members are silent and which are dead. If the engine says that this member itself is dead, its lease ends at
// once and the daemon joins again as a new member.
//
// Threads: step() from one thread at a time; the other members may be called from any thread. No lock is held during a
// call of the engine. Invariants: the lease of a member is extended only from the start of a beat that succeeded; a
// member that was declared dead, or left, is never this daemon's member again.
#ifndef LOCUS_SERVER_CLUSTER_MEMBERSHIP_H_
#define LOCUS_SERVER_CLUSTER_MEMBERSHIP_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/mutex.h"
#include "server/cluster/cluster_engine.h"
#include "server/cluster/cluster_timing.h"
#include "server/cluster/placement.h"
#include "server/cluster/ring.h"
#include "server/cluster/scene_lease.h"
#include "server/cluster/silence.h"

namespace locus::server {

class Membership {
 public:
  // Number of members after this one on the ring whose beats it watches; more if some of them are quiet, so that a run
  // of neighbours that die at once is noticed at once, at most kMaxWatched.
  static constexpr size_t kWatched = 3;
  static constexpr size_t kMaxWatched = 64;

  struct Options {
    MemberInfo info;
    std::function<uint64_t()> load;   // see ClusterHost::load()
    std::function<void()> on_change;  // called when Leadership::step() may have something to do; must not block
    ClusterClock clock;
    RandomBits random;  // called by the constructor and by step()
    ClusterTiming timing;
  };
  // This daemon's member at one moment.
  struct Self {
    MemberId id = 0;  // 0: has not joined
    std::shared_ptr<const MemberLease> lease;
    uint64_t assigned = 0;  // see BeatReply
    bool left = false;      // will never join again
  };

  // `engine` must outlive this object.
  Membership(ClusterEngine& engine, Options options);

  // Joins or beats, with one call of the engine. Returns the time of the next step.
  ClusterTime step() LOCUS_EXCLUDES(mutex_);

  Self self() const LOCUS_EXCLUDES(mutex_);
  // Returns true if the last own beat succeeded and the lease is living.
  bool engine_answers() const LOCUS_EXCLUDES(mutex_);
  // Makes the next beats say that this member takes no scenes.
  void take_no_scenes() LOCUS_EXCLUDES(mutex_);
  // Ends the lease and the beats for ever. Returns the id of the member, or 0 if it has not joined.
  MemberId leave() LOCUS_EXCLUDES(mutex_);

  // Returns a watched member that has been silent for so long that mark_dead() is to be called.
  std::optional<SeenBeat> suspect(ClusterTime now) const LOCUS_EXCLUDES(mutex_);
  // Stores the answer of mark_dead(), which came at `now`.
  void suspect_answered(MemberId id, bool dead, ClusterTime now) LOCUS_EXCLUDES(mutex_);
  // Returns the dead members that were noticed since the last call.
  std::vector<MemberId> take_noticed_dead() LOCUS_EXCLUDES(mutex_);
  // Returns a dead member whose scenes this member gives to others: one for which it is responsible, and whose
  // followers have had their time. See Ring.
  std::optional<MemberId> responsibility(ClusterTime now) const LOCUS_EXCLUDES(mutex_);
  // Returns true if this member is the one that searches for scenes without a leader.
  bool sweeps() const LOCUS_EXCLUDES(mutex_);
  // Records that a dead member was forgotten.
  void forgotten(MemberId id) LOCUS_EXCLUDES(mutex_);
  // Returns the first time at which suspect() or responsibility() may return a member unless a beat changes that.
  ClusterTime next_occasion(ClusterTime now) const LOCUS_EXCLUDES(mutex_);

 private:
  enum class State : uint8_t { kJoining, kMember, kLeft };

  ClusterTime join(MemberId id, uint64_t load) LOCUS_EXCLUDES(mutex_);
  ClusterTime beat(MemberId id, uint64_t load) LOCUS_EXCLUDES(mutex_);
  // Stores the answer to a beat. Returns true if there may be something to do.
  bool store(const BeatReply& reply, ClusterTime sent, ClusterTime received) LOCUS_REQUIRES(mutex_);
  // Ends the membership of a member that was declared dead.
  void end_membership() LOCUS_REQUIRES(mutex_);
  void begin_membership() LOCUS_REQUIRES(mutex_);

  ClusterEngine& engine_;
  const Options options_;
  mutable Mutex mutex_;
  State state_ LOCUS_GUARDED_BY(mutex_) = State::kJoining;
  MemberId id_ LOCUS_GUARDED_BY(mutex_) = 0;
  std::shared_ptr<MemberLease> lease_ LOCUS_GUARDED_BY(mutex_);
  uint64_t assigned_ LOCUS_GUARDED_BY(mutex_) = 0;
  bool answers_ LOCUS_GUARDED_BY(mutex_) = false;
  bool takes_scenes_ LOCUS_GUARDED_BY(mutex_) = true;
  SilenceCounter silence_ LOCUS_GUARDED_BY(mutex_);
  Ring ring_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_MEMBERSHIP_H_
