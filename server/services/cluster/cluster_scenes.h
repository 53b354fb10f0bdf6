// The scenes that this daemon leads in a cluster: reads a scene from the log when ClusterMember says so, registers it,
// and closes it when its leadership ends. Answers who has a scene that this daemon does not have.
//
// Threads: every member function may be called from any thread. Those that wait for the engine say so. Scenes are read
// on kReaders threads of this object; jobs of one scene run one after another. Lock order: mutex_, then the locks of
// the registry. Invariant: a scene is in the registry only while this daemon has its lease.
#ifndef LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_SCENES_H_
#define LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_SCENES_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "core/scene/registry.h"
#include "locus/v1/cluster.pb.h"
#include "locus/v1/view.pb.h"
#include "server/cluster/cluster_member.h"
#include "server/host/host.h"
#include "server/observability/latency_histogram.h"
#include "server/scheduling/change_queue.h"
#include "server/services/cluster/cluster_storage.h"
#include "server/services/cluster/scene_directory.h"

namespace locus::server {

class ClusterScenes final : public ClusterHost {
 public:
  // Number of scenes that are read at the same time.
  static constexpr uint32_t kReaders = 4;

  // Number of events since the start, and what is so now, for the metrics.
  struct Figures {
    uint64_t leading = 0;
    uint64_t begun = 0;   // leaderships begun: scenes created, moved here or taken over
    uint64_t fenced = 0;  // leaderships that ended because another member took over
    bool engine_answers = false;
    uint64_t members = 0;   // living members as last read, with this one
    LatencyCounts appends;  // times of acknowledged appends to the engine
  };

  // `host` and `storage` must outlive this object. `address` is where the others reach this daemon.
  ClusterScenes(Host& host, ClusterStorage& storage, const std::string& address);
  ~ClusterScenes() override { end(); }

  // Joins the cluster.
  void start();
  // Ends all threads but those of the directory, and releases the scenes. The scenes stay this member's: call drain()
  // before. Later calls return as if this daemon led nothing.
  void end() LOCUS_EXCLUDES(mutex_);
  // Ends a leadership whose append was refused, because another member leads the scene. Never waits.
  void fenced(SceneKey scene, Token token) { member_.fenced(scene, token); }
  // Leads a scene on with the token by which the log has fenced a lost append. Never waits.
  void token_raised(SceneKey scene, Token before, Token now) { member_.token_raised(scene, before, now); }
  // Writes snapshots, hands all scenes over and leaves the cluster. Waits until `deadline` at most.
  void drain(std::chrono::steady_clock::time_point deadline);

  // Creates a scene and gives it to a member, which may be this one. Waits for the engine. Errors: those of
  // Registry::create_scene() except RESOURCE_EXHAUSTED, with REASON_ELSEWHERE if another member leads `static_from`.
  struct Created {
    CatalogueScene row;
    bool existed = false;
  };
  absl::StatusOr<Created> create(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                 const std::string& static_from, bool if_absent);
  // Returns the scene once this daemon can answer for it, or why it does not within about a second, or until
  // `deadline`: ELSEWHERE, NO_LEADER or NOT_FOUND.
  absl::StatusOr<ScenePtr> wait_for(const std::string& name, std::chrono::steady_clock::time_point deadline =
                                                                 std::chrono::steady_clock::time_point::max());
  // Returns why the registry does not have the scene: NOT_FOUND, FAILED_PRECONDITION (ELSEWHERE) or UNAVAILABLE
  // (NO_LEADER). Never waits.
  absl::Status missing(const std::string& name);
  // Deletes a scene that this daemon leads. Waits for the engine.
  absl::Status remove(const std::string& name);
  // Ends the leadership of a scene that was deleted because it was idle. Waits for the engine if the scene has no log.
  void deleted(const Scene& scene);
  // Stores the settings of a scene without a log after they were changed. Waits for the engine.
  absl::Status store_settings(const Scene& scene);
  // Hands a scene that this daemon leads over to the member of address `to`, or to the less loaded of two others if
  // `to` is empty. Waits until `deadline` at most. See ServerService.MoveScene for the errors.
  absl::StatusOr<v1::MoveSceneResponse> move(const std::string& name, const std::string& to,
                                             std::chrono::steady_clock::time_point deadline);

  // Returns the time in milliseconds for which this daemon may have missed changes of the scene, rounded up; 0 while it
  // leads the scene. Never waits.
  uint32_t age_ms(const Scene& scene) const;
  // Returns age_ms(), or NO_LEADER if that is more than the view permits. Call it when the revision is pinned: no other
  // server can have acknowledged a later update then. Never waits.
  absl::StatusOr<uint32_t> check_view(const Scene& scene, const v1::View& view) const;

  // Return what the protocol says of a scene and of the cluster. Never wait.
  v1::ScenePlacement placement_of(const Scene& scene) const;
  v1::ScenePlacement placement_of(const CatalogueScene& row) const;
  v1::Cluster describe();
  Figures figures();
  // Returns the page of the cluster's scenes after `after`. Waits for the engine.
  absl::StatusOr<std::vector<CatalogueScene>> list(const std::string& after, size_t limit) {
    (void)directory_.members();  // so that the leaders' addresses are known
    return log_.list_catalogued(after, limit);
  }

  uint64_t load() override;
  // Returns the key of a scene that this daemon leads; 0 if it does not lead the scene any more. Never waits.
  SceneKey key_of(const Scene& scene) const LOCUS_EXCLUDES(mutex_);

  void start_leading(const LedScene& scene) override LOCUS_EXCLUDES(mutex_);
  void stop_leading(SceneKey scene, Token token, StopReason reason) override LOCUS_EXCLUDES(mutex_);
  void leader_changed(const LeaderRow& row) override LOCUS_EXCLUDES(mutex_);
  std::vector<FollowedScene> followed_scenes(MemberId) override { return {}; }
  std::vector<MemberId> caught_up_followers(SceneKey) override { return {}; }

 private:
  // A scene that this daemon leads, or begins to lead.
  struct Led {
    std::shared_ptr<const SceneLease> lease;
    std::string name;  // empty until the scene is read
    ScenePtr scene;    // null until the scene is registered, and if it is damaged
    bool deleted = false;
  };

  // Reads a scene and registers it; tries again later until that succeeds or the leadership ends.
  void read(const LedScene& led) LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<ScenePtr> read_once(const LedScene& led, std::string& name);
  // Makes a scene visible if this daemon still leads it. A null scene is damaged: see `damage`.
  void publish(const LedScene& led, const std::string& name, const ScenePtr& scene, const absl::Status& damage)
      LOCUS_EXCLUDES(mutex_);
  absl::Status elsewhere(const CatalogueScene& row);
  std::shared_ptr<const SceneLease> lease_of(const Scene& scene) const LOCUS_EXCLUDES(mutex_);
  // Returns the scene of this name that this daemon leads, damaged or not; an empty one, without a lease, if there is
  // none.
  std::pair<SceneKey, Led> find_led(const std::string& name) const LOCUS_EXCLUDES(mutex_);
  bool leads(SceneKey key) const LOCUS_EXCLUDES(mutex_);
  // Ends the leadership of a scene that was deleted, which does not count as fenced.
  void end_deleted(SceneKey key, const SceneLease& lease) LOCUS_EXCLUDES(mutex_);
  // Runs `job` on a reader's thread, after the earlier jobs of the scene. Does nothing after end().
  void submit(SceneKey key, std::function<void()> job) LOCUS_EXCLUDES(mutex_);
  void write_snapshots(std::chrono::steady_clock::time_point deadline);

  Host& host_;
  PostgresLog& log_;
  const std::string address_;
  const std::string engine_hosts_;
  const LatencyHistogram& appends_;
  const ClusterTiming timing_;
  const ClusterClock clock_ = &time_since_boot;
  SceneDirectory directory_;
  mutable Mutex mutex_;
  absl::flat_hash_map<SceneKey, Led> led_ LOCUS_GUARDED_BY(mutex_);
  absl::flat_hash_map<const Scene*, SceneKey> keys_ LOCUS_GUARDED_BY(mutex_);  // of the scenes in led_
  // Names of the scenes that are being handed over.
  absl::flat_hash_map<SceneKey, std::string> leaving_ LOCUS_GUARDED_BY(mutex_);
  std::atomic<uint64_t> begun_{0};
  std::atomic<uint64_t> fenced_{0};
  std::atomic<bool> ended_{false};
  std::atomic<bool> started_{false};
  ClusterMember member_;
  std::unique_ptr<ChangeQueue> readers_ LOCUS_GUARDED_BY(mutex_);  // null after end()
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_SCENES_H_
