// Writes a snapshot of a scene when its log has grown long; the snapshot replaces the log's records. So a restart
// replays few records, and the data directory is little larger than the scenes themselves.
//
// Threads: runs a thread of low priority; stats() may be called from any thread. Updates and queries never wait for a
// snapshot: a scene continues to change while its snapshot is written.
#ifndef LOCUS_SERVER_SCHEDULING_SNAPSHOTTER_H_
#define LOCUS_SERVER_SCHEDULING_SNAPSHOTTER_H_

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "core/base/limits.h"
#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"
#include "core/scene/registry.h"

namespace locus::server {

struct SnapshotterOptions {
  // Bytes of log records after which a scene is snapshotted again. If the estimated size of the scene's objects is
  // larger, it is used instead, so that snapshots write hardly more bytes than the log; the estimate leaves out
  // instances. A smaller value makes a restart faster.
  uint64_t log_bytes = limits::kSnapshotAfterBytes;
  // Time between two checks of all scenes.
  std::chrono::milliseconds poll_interval{250};
  // Time until the next check after a failure, such as a full disk.
  std::chrono::milliseconds retry_after{5000};
  // Called after each snapshot, on the snapshotter's thread, with the size in bytes or the error.
  std::function<void(const Scene& scene, const absl::StatusOr<uint64_t>& bytes)> on_snapshot;
};

struct SnapshotterStats {
  uint64_t written = 0;
  uint64_t bytes = 0;  // total size of the snapshots written
  uint64_t failed = 0;
};

class Snapshotter {
 public:
  // Starts the thread. `registry` and `log` must outlive the snapshotter. Does nothing if `log` is null.
  Snapshotter(const Registry& registry, UpdateLog* log, SnapshotterOptions options);
  // Abandons a snapshot in progress; the previous snapshot stays valid.
  ~Snapshotter();
  Snapshotter(const Snapshotter&) = delete;
  Snapshotter& operator=(const Snapshotter&) = delete;

  SnapshotterStats stats() const LOCUS_EXCLUDES(mutex_);

 private:
  void run() LOCUS_EXCLUDES(mutex_);
  // Waits for `time`. Returns false if the destructor was called meanwhile.
  bool wait_for(std::chrono::milliseconds time) LOCUS_EXCLUDES(mutex_);
  bool ended() const LOCUS_EXCLUDES(mutex_);
  // Checks all scenes and writes the snapshots that are due; returns false at the first failure.
  bool snapshot_due_scenes() LOCUS_EXCLUDES(mutex_);
  bool due(const Scene& scene) const;
  absl::StatusOr<uint64_t> write(Scene& scene) LOCUS_EXCLUDES(mutex_);

  const Registry& registry_;
  UpdateLog* const log_;
  const SnapshotterOptions options_;
  mutable Mutex mutex_;
  ConditionVariable end_;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  SnapshotterStats stats_ LOCUS_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_SNAPSHOTTER_H_
