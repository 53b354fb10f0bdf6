// The scenes that this daemon leads, each with its lease, and the stops that the host has not been notified of.
//
// Threads: every member function may be called from any thread; start(), take() and take_stopped() from one thread at a
// time. Invariant: a scene that is not in the table has no lease that is not stopped.
#ifndef LOCUS_SERVER_CLUSTER_LED_SCENES_H_
#define LOCUS_SERVER_CLUSTER_LED_SCENES_H_

#include <memory>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/mutex.h"
#include "server/cluster/cluster_host.h"

namespace locus::server {

class LedScenes {
 public:
  struct Stopped {
    SceneKey scene = 0;
    Token token = 0;
    StopReason reason = StopReason::kFenced;
  };

  struct Started {
    std::shared_ptr<const SceneLease> lease;  // null: the scene is in the table already, with this or a higher token
    std::vector<Stopped> before;              // stops that the host is to be notified of before it starts
  };

  // Adds a scene. A lower token is stopped as fenced. The stops up to this moment are returned with the lease, because
  // a stop of the new lease may follow at any time and must reach the host after the start.
  Started start(const LeaderRow& row, std::shared_ptr<const MemberLease> member) LOCUS_EXCLUDES(mutex_);
  // Stops the lease of a scene at once and removes the scene. Returns false, and does nothing, if its token is not
  // `token`.
  bool stop(SceneKey scene, Token token, StopReason reason) LOCUS_EXCLUDES(mutex_);
  void stop_all(StopReason reason) LOCUS_EXCLUDES(mutex_);
  // Makes the token of a scene `now`, if it is `before`. Returns false, and does nothing, if it is another one.
  bool raise(SceneKey scene, Token before, Token now) LOCUS_EXCLUDES(mutex_);
  // Stops the lease of a scene and removes the scene; the caller notifies the host. Returns its token, or nullopt.
  std::optional<Token> take(SceneKey scene) LOCUS_EXCLUDES(mutex_);
  // Returns the stops since the last call, in order.
  std::vector<Stopped> take_stopped() LOCUS_EXCLUDES(mutex_);

  // Returns the lease of a scene, or null.
  std::shared_ptr<const SceneLease> find(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  std::vector<SceneKey> keys() const LOCUS_EXCLUDES(mutex_);
  size_t size() const LOCUS_EXCLUDES(mutex_);

 private:
  mutable Mutex mutex_;
  absl::flat_hash_map<SceneKey, std::shared_ptr<SceneLease>> scenes_ LOCUS_GUARDED_BY(mutex_);
  std::vector<Stopped> stopped_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_LED_SCENES_H_
