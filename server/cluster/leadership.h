// Decides what this daemon leads. Places new scenes, takes over scenes of dead leaders, hands scenes over when the
// daemon drains or an operator moves them, and notifies the host. A scene changes its leader for no other reason.
//
// A daemon that follows scenes of a dead leader takes them over at once. What remains after `others_wait` is given by
// the member that is responsible for the dead one (ring.h) to the less loaded of two random members for each scene. A
// member notices that scenes were given to it because its beat returns how many were (`BeatReply::assigned`); then it
// compares its scenes with the engine's rows. That comparison also settles calls with an unknown outcome, because only
// it and known outcomes begin leading, and only on the thread of step().
//
// Threads: step() from one thread at a time, which also calls the host; the other members may be called from any
// thread. place() waits for the engine. No lock is held during a call of the engine or of the host. Members without
// LOCUS_GUARDED_BY belong to the thread of step(). Invariants: all leases that are not stopped are of the present
// member of this daemon; the scene that is being handed over is not led.
#ifndef LOCUS_SERVER_CLUSTER_LEADERSHIP_H_
#define LOCUS_SERVER_CLUSTER_LEADERSHIP_H_

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "server/cluster/cluster_engine.h"
#include "server/cluster/cluster_host.h"
#include "server/cluster/cluster_timing.h"
#include "server/cluster/led_scenes.h"
#include "server/cluster/membership.h"
#include "server/cluster/placement.h"

namespace locus::server {

class Leadership {
 public:
  // Function that receives the result of a move; called on the thread of step(), or of end().
  using MoveDone = std::function<void(const absl::Status&)>;

  struct Options {
    std::function<void()> wake;  // called from any thread when step() should be called soon; must not block
    ClusterClock clock;
    RandomBits random;  // called under a lock
    ClusterTiming timing;
  };

  // All references must outlive this object.
  Leadership(ClusterEngine& engine, Membership& membership, ClusterHost& host, Options options);

  // Does the most urgent work, with at most one call of the engine. Returns the time of the next step.
  ClusterTime step() LOCUS_EXCLUDES(mutex_);

  // Chooses the leader of a new scene and stores it. Returns the scene's row. Returns ABORTED if the scene has a leader
  // already, NOT_FOUND if it does not exist, UNAVAILABLE if the outcome is unknown or no member takes scenes; the
  // scene is then placed later, within some seconds after the engine or a member is back.
  absl::StatusOr<LeaderRow> place(SceneKey scene) LOCUS_EXCLUDES(mutex_);
  // Records that an append with `token` was refused because of the fence, or that the scene was deleted: its lease
  // stops at once. Returns false if the scene was not led with this token any more.
  bool fenced(SceneKey scene, Token token);
  // Records that this daemon itself made the token of a scene that it leads higher, to fence a lost append: its lease
  // continues. Returns false if the scene was not led with `before` any more; a comparison with the engine's rows may
  // have noticed the new token first, and then the scene was stopped and begun again.
  bool token_raised(SceneKey scene, Token before, Token now) { return led_.raise(scene, before, now); }
  // Hands a scene over to a follower that has all of its records or, if the scene has none, to any living member; does
  // nothing if `to` is this member. `done` receives NOT_FOUND if this daemon does not lead the scene, INVALID_ARGUMENT
  // if `to` is 0, FAILED_PRECONDITION if `to` is not such a member, UNAVAILABLE if the engine did not answer recently,
  // and ABORTED if the leader changed meanwhile; after the others of these this daemon leads as before, if it did.
  void move(SceneKey scene, MemberId to, MoveDone done) LOCUS_EXCLUDES(mutex_);
  // Ends after the last step(): the moves that wait, and later ones, receive CANCELLED. A move whose outcome was not
  // known yet receives UNAVAILABLE.
  void end() LOCUS_EXCLUDES(mutex_);
  // Begins to hand over all scenes, each to a follower that has all of its records or else to the less loaded of two
  // members, then to leave the cluster.
  void drain() LOCUS_EXCLUDES(mutex_);
  // Returns true if drain() has ended: this daemon leads nothing and is no member.
  bool drained() const LOCUS_EXCLUDES(mutex_);
  // Compares the led scenes with the engine's rows at the next step, because a peer has said that one was handed over.
  void reconcile_soon() LOCUS_EXCLUDES(mutex_);

  // Returns the lease of a scene that this daemon leads, or null.
  std::shared_ptr<const SceneLease> find(SceneKey scene) const { return led_.find(scene); }
  // Returns the number of scenes that this daemon leads.
  size_t size() const { return led_.size(); }

 private:
  struct Move {
    SceneKey scene = 0;
    MemberId to = 0;
    MoveDone done;        // may be empty
    bool drains = false;  // the daemon drains: any member will do, and `to` is 0
  };
  struct HandOver {
    Move move;
    Token token = 0;
    MemberId from = 0;
    MemberId to = 0;  // 0: no member takes the scene
  };
  // Scenes that this member gives to others: of a dead leader, or without a leader.
  struct Estate {
    MemberId dead = 0;  // 0: without a leader
    bool listed = false;
    std::deque<LeaderRow> scenes;
  };

  // Steps. Each returns true if it has made a call of the engine, or if there may be more to do.
  bool mark_suspect() LOCUS_EXCLUDES(mutex_);
  bool hand_over() LOCUS_EXCLUDES(mutex_);
  bool reconcile() LOCUS_EXCLUDES(mutex_);
  bool end_drain() LOCUS_EXCLUDES(mutex_);
  bool take_followed() LOCUS_EXCLUDES(mutex_);
  bool give_estate() LOCUS_EXCLUDES(mutex_);
  bool sweep() LOCUS_EXCLUDES(mutex_);

  // Stops leading if this daemon's member was declared dead.
  void adopt_member();
  // Notifies the host of stops.
  void deliver(const std::vector<LedScenes::Stopped>& stops);
  void deliver_stops() { deliver(led_.take_stopped()); }
  // Begins to lead the scene unless it is led with this token.
  void begin(const LeaderRow& row);
  // Postpones the next call of the engine after an error. Returns true.
  bool postpone();
  bool draining() const LOCUS_EXCLUDES(mutex_);

  // Begins the first move that waits, if its conditions hold, else finishes or postpones it. Returns false if none
  // waits.
  bool begin_hand_over() LOCUS_EXCLUDES(mutex_);
  // Returns the first move that waits; while draining, adds moves of all led scenes first.
  std::optional<Move> next_move() LOCUS_EXCLUDES(mutex_);
  void finish_move(const Move& move, const absl::Status& status) LOCUS_EXCLUDES(mutex_);
  // Refuses the moves that wait, because this daemon is no member and leads nothing.
  void refuse_moves() LOCUS_EXCLUDES(mutex_);
  // Returns the member that a scene is handed over to, or 0 if there is none.
  MemberId target_of(const Move& move, absl::Span<const MemberId> followers) LOCUS_EXCLUDES(mutex_);
  void give_first() LOCUS_EXCLUDES(mutex_);
  // Returns true if the table of members is fresh. Else reads it, with one call of the engine, and returns its status.
  bool table_is_fresh() const LOCUS_EXCLUDES(mutex_);
  absl::Status read_table() LOCUS_EXCLUDES(mutex_);

  ClusterEngine& engine_;
  Membership& membership_;
  ClusterHost& host_;
  const Options options_;
  LedScenes led_;

  Membership::Self self_;
  uint64_t known_assigned_ = 0;  // scenes given to this member that were compared, or taken by itself
  ClusterTime retry_at_ = ClusterTime::min();
  ClusterTime reconcile_at_ = ClusterTime::min();
  ClusterTime sweep_at_ = ClusterTime::min();
  std::deque<ClusterHost::FollowedScene> followed_;  // scenes of dead leaders that this member takes over
  std::optional<HandOver> hand_over_;
  std::optional<Estate> estate_;
  bool found_nothing_ = false;  // the last comparison found that this member leads nothing, and nothing began since
  MemberId leaving_ = 0;        // member that has ended its lease and is to leave

  mutable Mutex mutex_;
  PlacementTable table_ LOCUS_GUARDED_BY(mutex_);
  std::deque<Move> moves_ LOCUS_GUARDED_BY(mutex_);
  bool reconcile_soon_ LOCUS_GUARDED_BY(mutex_) = false;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  bool draining_ LOCUS_GUARDED_BY(mutex_) = false;
  bool drained_ LOCUS_GUARDED_BY(mutex_) = false;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_LEADERSHIP_H_
