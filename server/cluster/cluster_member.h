// This daemon in a cluster: its membership and its leadership, on two threads, so that beats are punctual while a
// takeover waits for the engine. The host (cluster_host.h) is told which scenes to lead.
//
// Threads: every member function may be called from any thread, start() and stop() once. Those that wait for the engine
// say so and must not be called by the host's callbacks.
#ifndef LOCUS_SERVER_CLUSTER_CLUSTER_MEMBER_H_
#define LOCUS_SERVER_CLUSTER_CLUSTER_MEMBER_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "server/cluster/cluster_engine.h"
#include "server/cluster/cluster_host.h"
#include "server/cluster/cluster_timing.h"
#include "server/cluster/leadership.h"
#include "server/cluster/membership.h"
#include "server/scheduling/lifetime_keeper.h"

namespace locus::server {

class ClusterMember {
 public:
  struct Options {
    MemberInfo info;
    ClusterTiming timing;
    // Clock of the leases. It must not stop while the process is stopped or the machine sleeps.
    ClusterClock clock = &time_since_boot;
    // Seed of the member ids and of placement: different for each run of each daemon.
    uint64_t seed = 0;
  };

  // `engine` and `host` must outlive this object.
  ClusterMember(ClusterEngine& engine, ClusterHost& host, Options options);
  // Calls stop().
  ~ClusterMember();
  ClusterMember(const ClusterMember&) = delete;
  ClusterMember& operator=(const ClusterMember&) = delete;

  // Starts both threads, which join the cluster and beat.
  void start();
  // Ends both threads, after a call of the engine that is running. The scenes stay this member's until others declare
  // it dead: call drain() before. Moves that wait end as CANCELLED, or as UNAVAILABLE if the engine did not answer.
  void stop();

  // Chooses the leader of a new scene, waiting for the engine: see Leadership::place().
  absl::StatusOr<LeaderRow> place(SceneKey scene) { return leadership_.place(scene); }
  // Stops leading a scene whose append was fenced, or that was deleted: see Leadership::fenced().
  bool fenced(SceneKey scene, Token token) { return leadership_.fenced(scene, token); }
  // Leads a scene on with another token, see Leadership::token_raised(): call it when PostgresLog reports the token.
  bool token_raised(SceneKey scene, Token before, Token now) { return leadership_.token_raised(scene, before, now); }
  // Hands a scene over to a follower that has all of its records, and waits for the result: see Leadership::move().
  // Returns DEADLINE_EXCEEDED if the result was not known at `deadline`; the move may still happen then.
  absl::Status move(SceneKey scene, MemberId to, std::chrono::steady_clock::time_point deadline);
  // Hands over all scenes and leaves the cluster. Waits until `deadline` at most. Returns true if this daemon leads
  // nothing and is no member any more.
  bool drain(std::chrono::steady_clock::time_point deadline);

  // Notices soon, not within a second, which scenes were given to this member, or which members have died: call after a
  // hint of a peer, or when the feed of a leader ended. At most ten calls a second have an effect.
  void look_soon();

  // Returns the id of this daemon's member, or 0 if it is none at present.
  MemberId id() const { return membership_.self().id; }
  // Returns true if the last beat succeeded and the lease is living.
  bool engine_answers() const { return membership_.engine_answers(); }
  // Returns the lease of a scene that this daemon leads, or null.
  std::shared_ptr<const SceneLease> find(SceneKey scene) const { return leadership_.find(scene); }
  // Returns the number of scenes that this daemon leads.
  size_t leading() const { return leadership_.size(); }

 private:
  using Time = LifetimeKeeper::Time;

  // Minimum time between beats of look_soon().
  static constexpr std::chrono::milliseconds kMinBeatInterval{100};
  // Interval at which drain() asks whether it has ended.
  static constexpr std::chrono::milliseconds kDrainPoll{10};

  // Returns the keeper's time of a time of the lease clock.
  Time keeper_time(ClusterTime time) const;
  void wake_scenes();

  const Options options_;
  Membership membership_;
  Leadership leadership_;
  std::atomic<Time::rep> last_beat_{Time::min().time_since_epoch().count()};
  // Each keeper has one task. They are destroyed first, because the tasks use the members above.
  LifetimeKeeper beats_;
  LifetimeKeeper scenes_;
  LifetimeKeeper::TaskId beats_task_ = 0;
  LifetimeKeeper::TaskId scenes_task_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_CLUSTER_MEMBER_H_
