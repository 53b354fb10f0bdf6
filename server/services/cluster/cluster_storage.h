// The engine of a cluster as main() opens it: the log of the scenes, and the tables of members and leaders.
#ifndef LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_STORAGE_H_
#define LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_STORAGE_H_

#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "server/config/server_config.h"
#include "server/observability/latency_histogram.h"
#include "server/storage/postgres_cluster.h"
#include "server/storage/postgres_log.h"

namespace locus::server {

// Connects the log with the part of the server that leads the scenes, which begins after the log was opened and ends
// before it is closed. Any thread may call the members.
class LogNotices {
 public:
  struct Receiver {
    // See PostgresOptions.
    std::function<void(SceneKey, uint64_t token)> on_fenced;
    std::function<void(SceneKey, uint64_t before, uint64_t now)> on_token;
  };

  // Sets the functions that are called; empty ones: nobody. Waits for a running call.
  void deliver_to(Receiver receiver) LOCUS_EXCLUDES(mutex_) {
    const MutexLock lock(mutex_);
    receiver_ = std::move(receiver);
  }
  void fenced(SceneKey scene, uint64_t token) LOCUS_EXCLUDES(mutex_) {
    const MutexLock lock(mutex_);
    if (receiver_.on_fenced != nullptr) receiver_.on_fenced(scene, token);
  }
  void token_raised(SceneKey scene, uint64_t before, uint64_t now) LOCUS_EXCLUDES(mutex_) {
    const MutexLock lock(mutex_);
    if (receiver_.on_token != nullptr) receiver_.on_token(scene, before, now);
  }

 private:
  Mutex mutex_;
  Receiver receiver_ LOCUS_GUARDED_BY(mutex_);
};

struct ClusterStorage {
  // Before the log, which uses both.
  std::unique_ptr<LogNotices> notices;
  std::unique_ptr<LatencyHistogram> appends;  // times of acknowledged appends
  std::unique_ptr<PostgresLog> log;
  std::unique_ptr<PostgresCluster> engine;
  std::string hosts;  // of the engine, without user and password
};

// Connects to the engine that config.cluster names. Errors: those of PostgresLog::open().
absl::StatusOr<ClusterStorage> open_cluster(const ServerConfig& config);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_STORAGE_H_
