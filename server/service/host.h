// What all services of one server share: the scenes, the threads, and the way from serving to ended. Members are safe
// to use from any thread by themselves.
#ifndef LOCUS_SERVER_SERVICE_HOST_H_
#define LOCUS_SERVER_SERVICE_HOST_H_

#include "core/scene/registry.h"
#include "core/scene/update_log.h"
#include "server/config/observability_limits.h"
#include "server/config/server_config.h"
#include "server/observability/metrics.h"
#include "server/observability/slow_queries.h"
#include "server/scheduling/change_queue.h"
#include "server/scheduling/clocks.h"
#include "server/scheduling/cost_estimates.h"
#include "server/scheduling/drain.h"
#include "server/scheduling/gate.h"
#include "server/scheduling/memory_budget.h"
#include "server/scheduling/query_scheduler.h"
#include "server/scheduling/update_pump.h"
#include "server/scheduling/worker_pool.h"
#include "server/service/memory_use.h"

namespace locus::server {

struct Host {
  // `with_log` is borrowed; null keeps scenes in memory only.
  Host(const ServerConfig& with, UpdateLog* with_log)
      : config(with),
        log(with_log),
        slow_queries(with.slow_query_ms),
        memory(with.memory_limit, process_memory(registry)),
        pool(with.threads),
        scheduler(scheduler_options(with)),
        updates(pump_options(with)),
        calls(with.max_calls),
        streams(with.max_streams) {}

  static constexpr uint32_t kChangeThreads = 2;

  static SchedulerOptions scheduler_options(const ServerConfig& config) {
    SchedulerOptions options;
    options.threads = config.threads;
    options.priority = config.batch_priority;
    options.clock = &thread_nanoseconds;
    return options;
  }
  static UpdatePumpOptions pump_options(const ServerConfig& config) {
    UpdatePumpOptions options;
    options.threads = config.threads;
    return options;
  }

  const ServerConfig config;
  UpdateLog* const log;
  CallMetrics metrics;
  SlowQueries slow_queries;
  Registry registry;
  MemoryBudget memory;
  WorkerPool pool;
  CostEstimates costs;
  QueryScheduler scheduler;
  UpdatePump updates;
  ChangeQueue changes{kChangeThreads, limits::kMaxPendingChanges};
  Gate calls;    // in work, streams apart
  Gate streams;  // open
  Gate health_watchers{kMaxHealthWatchers};
  Gate backups{limits::kMaxBackups};
  Drain drain;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICE_HOST_H_
