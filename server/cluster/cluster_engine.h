// Interface of the engine of a cluster: the replicated database in which all daemons keep who is a member, who leads
// which scene, and the fence. server/cluster decides with it alone who is dead and who leads; it has no election and no
// clock of the engine. Each function is one conditional statement, which takes effect as a whole or not at all.
//
// A member is one run of a daemon in the cluster: a random id that is never used again, and a beat, a number that its
// member increases each second. A dead member never becomes living again. The members in order of their ids form a
// ring: after the largest id comes the smallest. The token of a scene is one higher with each change of its leader, so
// it fences the writes of former leaders.
//
// Threads: every member function may be called from any thread. Calls wait for the engine, at most for the few seconds
// that its implementation sets. Errors of all functions: UNAVAILABLE if the engine does not answer; then the outcome is
// unknown: the statement may have taken effect, may still take effect later, or never. Other errors are named at each
// function; after them nothing has changed. All that is returned is committed: an implementation on PostgreSQL reads
// in transactions that lock a row, because after a restart a plain read can show a commit that no standby has.
#ifndef LOCUS_SERVER_CLUSTER_CLUSTER_ENGINE_H_
#define LOCUS_SERVER_CLUSTER_CLUSTER_ENGINE_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/scene/log/update_log.h"

namespace locus::server {

using MemberId = uint64_t;  // random, from 1 to kMaxMemberId; 0: no member
using Token = uint64_t;     // increases with each leadership of a scene; 0: it never had a leader

inline constexpr MemberId kMaxMemberId = (uint64_t{1} << 63) - 1;  // largest value of a signed column
// Load of a member that takes no scenes because it drains.
inline constexpr uint64_t kTakesNoScenes = (uint64_t{1} << 63) - 1;

struct MemberInfo {
  std::string address;  // where the other daemons and the clients reach the member
  std::string zone;     // part of the site that fails as one, may be empty
  std::string version;  // of the daemon
};

struct MemberRow {
  MemberId id = 0;
  MemberInfo info;
  uint64_t load = 0;  // in the unit of ClusterHost::load()
  uint64_t beat = 0;
  bool dead = false;
};

struct SeenBeat {
  MemberId id = 0;
  uint64_t beat = 0;
};

struct BeatReply {
  uint64_t assigned = 0;       // number of successful take_over() and hand_over() calls whose `to` was this member
  std::vector<SeenBeat> next;  // the next living members of the ring, nearest first
  std::vector<MemberId> dead;  // dead members that were not forgotten, at most kMaxListed
};

struct LeaderRow {
  SceneKey key = 0;
  MemberId leader = 0;
  Token token = 0;
  uint64_t last_sequence = 0;  // sequence number of the last record
  uint64_t epoch = 0;
};

class ClusterEngine {
 public:
  // Maximum length of `BeatReply::dead` and of the result of scenes_without_leader().
  static constexpr size_t kMaxListed = 4096;

  virtual ~ClusterEngine() = default;

  // Adds a living member with beat 0. Does nothing if the id exists, so that the call may be repeated.
  virtual absl::Status join(MemberId id, const MemberInfo& info, uint64_t load) = 0;
  // Increases the beat of a living member and stores its load. Returns the next `watched` living members of the ring
  // without the member itself. Returns NOT_FOUND if the member is dead or forgotten.
  virtual absl::StatusOr<BeatReply> beat(MemberId id, uint64_t load, size_t watched) = 0;
  // Marks a living member as dead if its beat is still `seen.beat`. Returns true if the member is dead afterwards,
  // also if another member marked it.
  virtual absl::StatusOr<bool> mark_dead(SeenBeat seen) = 0;
  // Marks a member as dead whatever its beat is. Only the member itself calls it. Does nothing if the id is unknown.
  virtual absl::Status leave(MemberId id) = 0;
  // Removes a dead member that leads no scene from all lists. Returns FAILED_PRECONDITION if it is living or leads a
  // scene. Does nothing if the id is unknown. The id stays taken, so that a late join() does not make it live again.
  virtual absl::Status forget(MemberId id) = 0;
  // Returns all living members. Cost: the size of the cluster.
  virtual absl::StatusOr<std::vector<MemberRow>> members() = 0;

  // Returns the scenes whose leader is `leader`.
  virtual absl::StatusOr<std::vector<LeaderRow>> scenes_led_by(MemberId leader) = 0;
  // Returns scenes whose leader is 0 or an unknown id, at most kMaxListed of them.
  virtual absl::StatusOr<std::vector<LeaderRow>> scenes_without_leader() = 0;
  // Makes `to` the leader of a scene and its token `seen` + 1, if its token is `seen` and `to` is living. Precondition:
  // the caller knows that at token `seen` the scene had no leader, or one that is dead. Returns ABORTED if the token is
  // not `seen`, else FAILED_PRECONDITION if `to` is not living. Returns NOT_FOUND if the scene does not exist.
  virtual absl::StatusOr<LeaderRow> take_over(SceneKey scene, Token seen, MemberId to) = 0;
  // Makes `to`, or no member if `to` is 0, the leader of a scene and its token `token` + 1, if its token is `token` and
  // its leader is `from`, and `to` is living. Returns ABORTED if token or leader differ, and the other errors of
  // take_over().
  virtual absl::StatusOr<LeaderRow> hand_over(SceneKey scene, Token token, MemberId from, MemberId to) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_CLUSTER_ENGINE_H_
