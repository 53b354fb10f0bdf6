// The state that all services of one server share: the state of its calls, its scenes, thread pools and limits. Each
// member is thread-safe on its own. Members are destroyed in reverse order, so threads end before the scenes that they
// use.
#ifndef LOCUS_SERVER_HOST_HOST_H_
#define LOCUS_SERVER_HOST_HOST_H_

#include <algorithm>
#include <string>

#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"
#include "core/scene/registry.h"
#include "server/config/observability_limits.h"
#include "server/config/server_config.h"
#include "server/host/memory_keeper.h"
#include "server/host/memory_use.h"
#include "server/observability/line_limit.h"
#include "server/observability/process_figures.h"
#include "server/observability/slow_queries.h"
#include "server/rpc/rpc_state.h"
#include "server/scheduling/admission_limiter.h"
#include "server/scheduling/change_queue.h"
#include "server/scheduling/clocks.h"
#include "server/scheduling/cost_estimates.h"
#include "server/scheduling/idle_scenes.h"
#include "server/scheduling/lease_keeper.h"
#include "server/scheduling/lifetime_keeper.h"
#include "server/scheduling/mesh_collector.h"
#include "server/scheduling/query_scheduler.h"
#include "server/scheduling/snapshotter.h"
#include "server/scheduling/turns.h"
#include "server/scheduling/update_queue.h"
#include "server/scheduling/worker_pool.h"

namespace locus::server {

class ClusterMeshes;
class ClusterScenes;

struct Host : RpcState {
  // `with_log` is the durable log, borrowed; if it is null, scenes are stored in memory only.
  Host(const ServerConfig& with, UpdateLog* with_log)
      : RpcState(with.max_calls, with.max_streams, with.memory_limit, resident_bytes),
        config(with),
        log(with_log),
        slow_queries(with.slow_query_ms),
        registry(with_log),
        pool(with.threads),
        scheduler(scheduler_options(with)),
        updates(queue_options(with, with_log)) {
    RpcState::idle_scenes = &idle_scenes;
  }
  ~Host() {
    lifetimes.stop();
    lease_ends.stop();
  }

  static constexpr uint32_t kChangeThreads = 2;
  // Minimum weight in bytes of the connections that are closed when memory is nearly full; see
  // ConnectionTable::shed_heaviest().
  static constexpr uint64_t kMinShedBytes = 128u << 10;
  static constexpr uint32_t kLoggingThreads = 8;
  // Maximum number of log lines a second about leases that ended.
  static constexpr uint32_t kMaxLeaseLines = 16;

  static SchedulerOptions scheduler_options(const ServerConfig& config) {
    SchedulerOptions options;
    options.threads = config.threads;
    options.priority = config.batch_priority;
    options.clock = &thread_nanoseconds;
    return options;
  }
  // Returns the options of the update queue. If there is a log, the queue has at least kLoggingThreads threads, even on
  // a machine with few cores: the threads mostly wait for the disk, and batches that wait at the same time share one
  // sync.
  static UpdateQueueOptions queue_options(const ServerConfig& config, const UpdateLog* log) {
    UpdateQueueOptions options;
    options.threads = log == nullptr ? config.threads : std::max(config.threads, kLoggingThreads);
    return options;
  }
  static SnapshotterOptions snapshotter_options(const ServerConfig& config);

  // Returns the memory budget in bytes of the readers of a scene: the option pinned_limit if it is set. Otherwise, if a
  // quarter of the memory limit is below limits::kPinnedBytes, returns this quarter, but at least
  // limits::kMinPinnedBytes. Otherwise returns 0, which selects the default of ReaderTracker.
  uint64_t pinned_limit() const {
    const uint64_t share = config.memory_limit / 4;
    if (config.pinned_limit != 0 || share >= limits::kPinnedBytes) return config.pinned_limit;
    return std::max(share, limits::kMinPinnedBytes);
  }

  // Begins to delete idle scenes and unused meshes and to end leases. Call once, when all scenes are recovered: the
  // times of all scenes, meshes and leases begin.
  void start_lifetimes();

  const ServerConfig config;
  // Host and port of the HTTP pages; the port is 0 if there are none. Set before the first call is served.
  std::string http_host;
  uint16_t http_port = 0;
  UpdateLog* const log;
  // The daemon's part in a cluster (server/services/cluster); both null without a cluster. Set before the first call is
  // served.
  ClusterScenes* cluster = nullptr;
  ClusterMeshes* cluster_meshes = nullptr;
  SlowQueries slow_queries;
  Registry registry;
  Mutex create_mutex;  // held while the scenes are counted and a scene is added
  WorkerPool pool;
  CostEstimates costs;
  QueryScheduler scheduler;
  UpdateQueue updates;
  Snapshotter snapshots{registry, log, snapshotter_options(config)};
  // Before `changes`, whose jobs use them. The ends of leases have a thread of their own, so that they do not wait for
  // the deletion of a scene or mesh. ~Host() ends both threads first, because their tasks use the other members.
  LifetimeKeeper lifetimes;
  LifetimeKeeper lease_ends;
  IdleScenes idle_scenes{lifetimes, registry, [this](const ScenePtr& scene, const absl::Status& status) {
                           report_idle_scene(scene, status);
                         }};
  MeshCollector mesh_collector{lifetimes, registry,
                               MeshCollector::Reports{[this](const std::string& mesh, const absl::Status& status) {
                                                        report_unused_mesh(mesh, status);
                                                      },
                                                      &Host::report_unmarked_meshes}};
  LineLimit lease_lines{kMaxLeaseLines};
  LeaseKeeper leases{lease_ends, [this](const Scene& scene, uint64_t writer, const absl::StatusOr<uint64_t>& removed) {
                       report_lease(scene, writer, removed);
                     }};
  ChangeQueue changes{kChangeThreads, limits::kMaxPendingChanges};
  MemoryKeeper memory_keeper{
      memory, registry,
      [this](bool close) { return connections.shed_heaviest(close, kMinShedBytes, "memory is nearly full"); }, log};
  // Limits the calls that visit all objects of a scene, to describe or dump it: at the same time, at most half as many
  // as `config.threads` work, but at least one.
  Turns scene_visits{std::max(1u, config.threads / 2)};
  AdmissionLimiter health_watchers{kMaxHealthWatchers, Sharing::kFair};
  AdmissionLimiter health_checks{kMaxHealthChecks, Sharing::kFair};
  AdmissionLimiter reflections{kMaxReflections, Sharing::kFair};
  AdmissionLimiter backups{limits::kMaxBackups};

 private:
  // Log and audit that a scene or mesh was deleted because it was not used, or could not be deleted.
  void report_idle_scene(const ScenePtr& scene, const absl::Status& status);
  void report_unused_mesh(const std::string& mesh, const absl::Status& status);
  // Logs that meshes of a scene could not be recorded as meshes that may be deleted.
  static void report_unmarked_meshes(const Scene& scene, const absl::Status& status);
  // Logs and audits that the objects of a silent writer were removed, or could not be removed.
  void report_lease(const Scene& scene, uint64_t writer, const absl::StatusOr<uint64_t>& removed);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_HOST_H_
