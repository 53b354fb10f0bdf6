// Keeps logs short: where the records of a scene have become many, a snapshot of it takes their place, so that a
// restart has little to do again and the disk holds little more than the scenes themselves.
//
// Threads: a thread of its own, below those that serve; stats() from any. Nobody waits for it: a scene goes on while
// its snapshot is written.
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
  // Of records since the last snapshot: a scene with more gets another. For a scene that takes more than that itself,
  // as much as it takes, so that snapshots never write more than the log does. Lower it for a faster restart.
  uint64_t log_bytes = limits::kSnapshotAfterBytes;
  // Between two looks at all scenes.
  std::chrono::milliseconds look_every{250};
  // After a failure, for example of a full disk.
  std::chrono::milliseconds retry_after{5000};
  // Hears of each snapshot, with its size, or why there is none. Called by the keeper's thread.
  std::function<void(const Scene& scene, const absl::StatusOr<uint64_t>& bytes)> tell;
};

struct SnapshotKeeperStats {
  uint64_t written = 0;
  uint64_t bytes = 0;  // of all that were written
  uint64_t failed = 0;
};

class Snapshotter {
 public:
  // Both outlive it. Without a log it does nothing.
  Snapshotter(const Registry& registry, UpdateLog* log, SnapshotterOptions options);
  // Gives up a snapshot that is being written: the one before is still there.
  ~Snapshotter();
  Snapshotter(const Snapshotter&) = delete;
  Snapshotter& operator=(const Snapshotter&) = delete;

  SnapshotKeeperStats stats() const LOCUS_EXCLUDES(mutex_);

 private:
  void run() LOCUS_EXCLUDES(mutex_);
  // True after that time, false at the end.
  bool wait_for(std::chrono::milliseconds time) LOCUS_EXCLUDES(mutex_);
  bool ended() const LOCUS_EXCLUDES(mutex_);
  // Until one fails.
  bool look_at_all() LOCUS_EXCLUDES(mutex_);
  bool due(const Scene& scene) const;
  absl::StatusOr<uint64_t> write(Scene& scene) LOCUS_EXCLUDES(mutex_);

  const Registry& registry_;
  UpdateLog* const log_;
  const SnapshotterOptions options_;
  mutable Mutex mutex_;
  ConditionVariable end_;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  SnapshotKeeperStats stats_ LOCUS_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_SNAPSHOTTER_H_
