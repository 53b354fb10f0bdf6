// What all services of one server share: the scenes, the threads, and the way from serving to ended. Members are safe
// to use from any thread by themselves.
#ifndef LOCUS_SERVER_SERVICE_HOST_H_
#define LOCUS_SERVER_SERVICE_HOST_H_

#include "core/scene/registry.h"
#include "server/config/server_config.h"
#include "server/scheduling/change_queue.h"
#include "server/scheduling/drain.h"
#include "server/scheduling/gate.h"
#include "server/scheduling/memory_budget.h"
#include "server/scheduling/thread_group.h"
#include "server/scheduling/worker_pool.h"
#include "server/service/memory_use.h"

namespace locus::server {

struct Host {
  explicit Host(const ServerConfig& with)
      : config(with),
        memory(with.memory_limit, process_memory(registry)),
        pool(with.threads),
        calls(with.max_calls),
        streams(with.max_streams) {}

  static constexpr uint32_t kChangeThreads = 2;

  const ServerConfig config;
  Registry registry;
  MemoryBudget memory;
  WorkerPool pool;
  ChangeQueue changes{kChangeThreads, limits::kMaxPendingChanges};
  Gate calls;           // in work, streams apart
  ThreadGroup streams;  // one thread each
  Drain drain;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICE_HOST_H_
