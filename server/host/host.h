// The state that all services of one server share: scenes, thread pools, limits, metrics and the drain. The members are
// thread-safe on their own; their order is the order of construction, so threads end before the scenes they use.
#ifndef LOCUS_SERVER_HOST_HOST_H_
#define LOCUS_SERVER_HOST_HOST_H_

#include <algorithm>
#include <atomic>

#include "core/scene/log/update_log.h"
#include "core/scene/registry.h"
#include "server/config/observability_limits.h"
#include "server/config/server_config.h"
#include "server/host/memory_use.h"
#include "server/observability/metrics.h"
#include "server/observability/slow_queries.h"
#include "server/scheduling/admission_limiter.h"
#include "server/scheduling/change_queue.h"
#include "server/scheduling/clocks.h"
#include "server/scheduling/cost_estimates.h"
#include "server/scheduling/drain.h"
#include "server/scheduling/memory_budget.h"
#include "server/scheduling/query_scheduler.h"
#include "server/scheduling/snapshotter.h"
#include "server/scheduling/update_queue.h"
#include "server/scheduling/worker_pool.h"

namespace locus::server {

struct Host {
  // `with_log` is borrowed; null keeps scenes in memory only.
  Host(const ServerConfig& with, UpdateLog* with_log)
      : config(with),
        log(with_log),
        slow_queries(with.slow_query_ms),
        registry(with_log),
        memory(with.memory_limit, process_memory(registry)),
        pool(with.threads),
        scheduler(scheduler_options(with)),
        updates(queue_options(with, with_log)),
        calls(with.max_calls),
        streams(with.max_streams) {}

  static constexpr uint32_t kChangeThreads = 2;
  static constexpr uint32_t kLoggingThreads = 8;

  static SchedulerOptions scheduler_options(const ServerConfig& config) {
    SchedulerOptions options;
    options.threads = config.threads;
    options.priority = config.batch_priority;
    options.clock = &thread_nanoseconds;
    return options;
  }
  // Returns the options of the update queue. With a log it has more threads than cores, because they mostly wait for
  // the disk, and batches that wait at the same time share one sync.
  static UpdateQueueOptions queue_options(const ServerConfig& config, const UpdateLog* log) {
    UpdateQueueOptions options;
    options.threads = log == nullptr ? config.threads : std::max(config.threads, kLoggingThreads);
    return options;
  }
  static SnapshotterOptions snapshotter_options(const ServerConfig& config);

  const ServerConfig config;
  UpdateLog* const log;
  CallMetrics metrics;
  SlowQueries slow_queries;
  Registry registry;
  MemoryBudget memory;
  WorkerPool pool;
  CostEstimates costs;
  QueryScheduler scheduler;
  UpdateQueue updates;
  Snapshotter snapshots{registry, log, snapshotter_options(config)};
  ChangeQueue changes{kChangeThreads, limits::kMaxPendingChanges};
  AdmissionLimiter calls;    // running calls, except streams
  AdmissionLimiter streams;  // open streams
  AdmissionLimiter health_watchers{kMaxHealthWatchers};
  AdmissionLimiter backups{limits::kMaxBackups};
  Drain drain;
  std::atomic<bool> recovering{false};  // true while the scenes of the log are being recovered
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_HOST_H_
