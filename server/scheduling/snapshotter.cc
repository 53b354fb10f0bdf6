#include "server/scheduling/snapshotter.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "core/scene/log/state_writer.h"
#include "server/scheduling/thread_priority.h"

namespace locus::server {
namespace {

using std::chrono::steady_clock;

// Approximate size in bytes of an object in a snapshot.
constexpr uint64_t kObjectBytes = 80;

}  // namespace

Snapshotter::Snapshotter(const Registry& registry, UpdateLog* log, SnapshotterOptions options)
    : registry_(registry), log_(log), options_(std::move(options)) {
  if (log_ != nullptr) thread_ = std::thread([this] { run(); });
}

Snapshotter::~Snapshotter() {
  if (log_ == nullptr) return;
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    end_.notify_all();
  }
  thread_.join();
}

SnapshotterStats Snapshotter::stats() const {
  const MutexLock lock(mutex_);
  return stats_;
}

bool Snapshotter::ended() const {
  const MutexLock lock(mutex_);
  return ended_;
}

bool Snapshotter::wait_for(std::chrono::milliseconds time) {
  const steady_clock::time_point until = steady_clock::now() + time;
  const MutexLock lock(mutex_);
  while (!ended_ && steady_clock::now() < until) end_.wait_until(mutex_, until);
  return !ended_;
}

void Snapshotter::run() {
  take_batch_priority(BatchPriority::kNice);
  bool ok = true;
  while (wait_for(ok ? options_.poll_interval : options_.retry_after)) ok = snapshot_due_scenes();
}

bool Snapshotter::snapshot_due_scenes() {
  std::string after;
  while (true) {
    const std::vector<ScenePtr> scenes = registry_.list_scenes(after, limits::kMaxPageSize);
    for (const ScenePtr& scene : scenes) {
      after = scene->name();
      if (ended()) return true;
      if (!due(*scene)) continue;
      const absl::StatusOr<uint64_t> bytes = write(*scene);
      if (ended()) return true;
      if (absl::IsNotFound(bytes.status())) continue;  // the scene was deleted meanwhile, so it needs no snapshot
      if (options_.on_snapshot) options_.on_snapshot(*scene, bytes);
      const MutexLock lock(mutex_);
      stats_.written += bytes.ok() ? 1 : 0;
      stats_.bytes += bytes.value_or(0);
      stats_.failed += bytes.ok() ? 0 : 1;
      if (!bytes.ok()) return false;
    }
    if (scenes.size() < limits::kMaxPageSize) return true;
  }
}

bool Snapshotter::due(const Scene& scene) const {
  if (scene.log_key() == 0) return false;
  const uint64_t scene_bytes = kObjectBytes * scene.latest()->objects.size();
  return scene.log_position().bytes > std::max(options_.log_bytes, scene_bytes);
}

absl::StatusOr<uint64_t> Snapshotter::write(Scene& scene) {
  LOCUS_DCHECK(log_ != nullptr);
  LOCUS_DCHECK_NE(scene.log_key(), 0u);
  const FrozenScene frozen = scene.freeze();
  StateWriter writer(frozen);
  const auto next = [&]() -> absl::StatusOr<std::optional<std::string>> {
    if (ended()) return absl::CancelledError("the server ends");
    return writer.next();
  };
  RETURN_IF_ERROR(log_->write_snapshot(scene.log_key(), frozen.sequence, next));
  scene.snapshot_written(frozen.sequence, frozen.log_bytes);
  return writer.bytes();
}

}  // namespace locus::server
