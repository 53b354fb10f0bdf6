// Interface through which the cluster asks the daemon for what it knows and tells it which scenes to lead. Implemented
// by the daemon's services.
//
// Threads: load() and the functions about followers are called on the threads of the cluster, start_leading(),
// stop_leading() and leader_changed() on its thread for scenes only, one at a time and in order, so that a scene's
// starts and stops alternate. No lock is held during a call. The calls must return soon, because takeovers wait
// meanwhile: recover a scene on another thread. They may call every member function of ClusterMember but those that
// wait: drain(), move(), stop() and place().
#ifndef LOCUS_SERVER_CLUSTER_CLUSTER_HOST_H_
#define LOCUS_SERVER_CLUSTER_CLUSTER_HOST_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "server/cluster/cluster_engine.h"
#include "server/cluster/scene_lease.h"

namespace locus::server {

// Reason for which this daemon stops leading a scene.
enum class StopReason : uint8_t {
  kFenced,        // another member leads it, or the scene was deleted
  kDeclaredDead,  // this member was declared dead
  kHandedOver,    // this daemon drains, or an operator moves the scene
};

class ClusterHost {
 public:
  struct LedScene {
    LeaderRow row;  // the leader is this member; append with the row's token after its last sequence number
    std::shared_ptr<const SceneLease> lease;
  };
  struct FollowedScene {
    SceneKey key = 0;
    Token token = 0;  // of the leader that the feed names
  };

  virtual ~ClusterHost() = default;

  // Returns the load of this daemon, below kTakesNoScenes. Scenes are placed on members of less load. The unit is the
  // same for all members.
  virtual uint64_t load() = 0;

  // Begins to lead a scene: read its log up to the row's last sequence number, then serve it. Claim only what `lease`
  // allows: it may have ended already.
  virtual void start_leading(const LedScene& scene) = 0;
  // Ends leading: when this returns, no further append with `token` begins. The scene's lease has been stopped before,
  // perhaps by another thread and longer ago. The token is that of the start, or the one to which token_raised() raised
  // it. Nothing was published that was not committed, so nothing is undone.
  virtual void stop_leading(SceneKey scene, Token token, StopReason reason) = 0;
  // Notifies that this member made another one, or none if `row.leader` is 0, the leader: the daemon may tell it, or
  // its followers, before they notice by themselves within a second.
  virtual void leader_changed(const LeaderRow& row) = 0;

  // Returns the scenes of this leader that this daemon follows and is able to lead.
  virtual std::vector<FollowedScene> followed_scenes(MemberId leader) = 0;
  // Returns the members that follow a scene that this daemon leads and have all of its records.
  virtual std::vector<MemberId> caught_up_followers(SceneKey scene) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_CLUSTER_HOST_H_
