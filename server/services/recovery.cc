#include "server/services/recovery.h"

#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/mutex.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "core/scene/recovery.h"
#include "core/scene/spec_codec.h"
#include "server/convert/status.h"
#include "server/host/epoch.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

using std::chrono::steady_clock;

// Interval between two log lines about the progress of a long recovery.
constexpr std::chrono::seconds kReportEvery{5};

std::string milliseconds_since(steady_clock::time_point start) {
  return absl::StrCat(std::chrono::duration_cast<std::chrono::milliseconds>(steady_clock::now() - start).count());
}

// One run of recover_all(). The private members run on several threads of the pool.
class Recovery {
 public:
  Recovery(Host& host, const std::atomic<bool>& stop) : host_(host), log_(*host.log), stop_(stop) {}

  absl::Status run() {
    const std::vector<StoredScene>& scenes = log_.stored_scenes();
    const std::vector<StoredMesh>& meshes = log_.stored_meshes();
    total_ = scenes.size() + meshes.size();
    if (const absl::Status damage = log_.catalogue_damage(); !damage.ok()) log(LogLevel::kError, damage.message());
    if (total_ == 0) return absl::OkStatus();
    log(LogLevel::kInfo, "recovering",
        {{"scenes", absl::StrCat(scenes.size())}, {"meshes", absl::StrCat(meshes.size())}});
    // Meshes with equal content are recovered once, under the first of their names; the other names share the result.
    std::map<Sha256, std::vector<const StoredMesh*>> contents;
    for (const StoredMesh& mesh : meshes) contents[mesh.sha256].push_back(&mesh);
    std::vector<const std::vector<const StoredMesh*>*> lists;
    lists.reserve(contents.size());
    for (const auto& [sha256, names] : contents) lists.push_back(&names);
    host_.pool.parallel_for(lists.size(), [&](size_t i) { recover(*lists[i]); });
    host_.pool.parallel_for(scenes.size(), [&](size_t i) { recover(scenes[i]); });
    if (stop_.load()) return absl::CancelledError("stopped before all scenes were recovered");
    const MutexLock lock(mutex_);
    if (failure_.ok())
      log(LogLevel::kInfo, "recovered",
          {{"milliseconds", milliseconds_since(start_)}, {"damaged", absl::StrCat(damaged_)}});
    return failure_;
  }

 private:
  bool continues() LOCUS_EXCLUDES(mutex_) {
    const MutexLock lock(mutex_);
    return failure_.ok() && !stop_.load();
  }

  void recover(const std::vector<const StoredMesh*>& names) {
    if (!continues()) return;
    const steady_clock::time_point start = steady_clock::now();
    const absl::StatusOr<RecoveredMesh> mesh = recover_intact(*names.front());
    if (mesh.ok())
      log(LogLevel::kInfo, "mesh recovered",
          {{"mesh", names.front()->name},
           {"triangles", absl::StrCat(mesh->mesh->triangle_count())},
           {"tree", mesh->built ? "built" : "restored"},
           {"milliseconds", milliseconds_since(start)}});
    for (const StoredMesh* name : names) {
      const absl::StatusOr<MeshPtr> named = mesh.ok() ? recover_name(log_, *name, mesh->mesh) : mesh.status();
      if (named.ok()) {
        host_.registry.restore_mesh(name->name, *named, name->grace_s);
      } else if (take_damage("mesh", name->name, named.status())) {
        host_.registry.restore_damaged_mesh(name->name, damaged_data("mesh", named.status()));
      }
      count();
    }
  }

  void recover(const StoredScene& stored) {
    if (!continues()) return;
    const steady_clock::time_point start = steady_clock::now();
    const absl::StatusOr<ScenePtr> scene = recover_intact(stored);
    if (scene.ok()) {
      host_.registry.restore_scene(*scene);
      log(LogLevel::kInfo, "scene recovered",
          {{"scene", stored.name},
           {"objects", absl::StrCat((*scene)->latest()->objects.size())},
           {"records", absl::StrCat(stored.last_sequence - stored.snapshot_sequence)},
           {"milliseconds", milliseconds_since(start)}});
    } else if (take_damage("scene", stored.name, scene.status())) {
      host_.registry.restore_damaged_scene(stored.name, stored.key, damaged_data("scene", scene.status()));
    }
    count();
  }

  absl::StatusOr<RecoveredMesh> recover_intact(const StoredMesh& stored) {
    if (!stored.damage.ok()) return stored.damage;
    BvhOptions options;
    options.cancel = &stop_;
    options.parallel_for = [this](size_t n, const std::function<void(size_t)>& work) {
      host_.pool.parallel_for(n, work);
    };
    return recover_mesh(log_, stored, options);
  }

  // Recovers one scene. Starts a new epoch in two cases. First: acks did not wait for the disk and the last process
  // crashed, so acknowledged updates may be missing. Second: the directory is a restored backup, so the original scene
  // may have advanced since.
  absl::StatusOr<ScenePtr> recover_intact(StoredScene stored) {
    if (!stored.damage.ok()) return stored.damage;
    ASSIGN_OR_RETURN(SceneSpec spec, decode_spec(stored.spec));
    // The stored limit on pinned memory is the option of the daemon that created the scene. Replace it by the option of
    // this daemon.
    spec.pinned_bytes = host_.pinned_limit();
    stored.spec = encode_spec(spec);
    if (stored.copied || (spec.durability == Durability::kMemory && !log_.closed_in_order())) {
      stored.epoch = new_epoch();
      RETURN_IF_ERROR(log_.restart_scene(stored.key, stored.epoch));
    }
    return recover_scene(log_, stored, find_restored_meshes(log_, host_.registry));
  }

  // Logs the error and returns whether the error is damage (DATA_LOSS). Any other error ends the recovery.
  bool take_damage(const char* kind, const std::string& name, const absl::Status& status) LOCUS_EXCLUDES(mutex_) {
    log(LogLevel::kError, status.message(), {{kind, name}});
    const MutexLock lock(mutex_);
    const bool damage = status.code() == absl::StatusCode::kDataLoss;
    if (damage)
      ++damaged_;
    else
      failure_ = status;
    return damage;
  }

  // Counts a mesh or scene whose recovery has ended, intact or damaged, and logs the progress every kReportEvery.
  void count() LOCUS_EXCLUDES(mutex_) {
    const MutexLock lock(mutex_);
    ++done_;
    if (steady_clock::now() - reported_ < kReportEvery || done_ == total_) return;
    reported_ = steady_clock::now();
    log(LogLevel::kInfo, "recovering", {{"done", absl::StrCat(done_)}, {"of", absl::StrCat(total_)}});
  }

  Host& host_;
  UpdateLog& log_;
  const std::atomic<bool>& stop_;
  const steady_clock::time_point start_ = steady_clock::now();
  size_t total_ = 0;
  Mutex mutex_;
  absl::Status failure_ LOCUS_GUARDED_BY(mutex_);
  size_t done_ LOCUS_GUARDED_BY(mutex_) = 0;
  size_t damaged_ LOCUS_GUARDED_BY(mutex_) = 0;
  steady_clock::time_point reported_ LOCUS_GUARDED_BY(mutex_) = start_;
};

void log_snapshot(const Scene& scene, const absl::StatusOr<uint64_t>& bytes) {
  if (bytes.ok())
    log(LogLevel::kInfo, "snapshot written",
        {{"scene", scene.name()},
         {"bytes", absl::StrCat(*bytes)},
         {"sequence", absl::StrCat(scene.log_position().snapshot_sequence)}});
  else
    log(LogLevel::kWarning, "no snapshot could be written; the log continues to grow",
        {{"scene", scene.name()}, {"why", std::string(bytes.status().message())}});
}

}  // namespace

absl::Status recover_all(Host& host, const std::atomic<bool>& stop) { return Recovery(host, stop).run(); }

SnapshotterOptions Host::snapshotter_options(const ServerConfig& config) {
  SnapshotterOptions options;
  options.log_bytes = config.snapshot_after;
  options.on_snapshot = log_snapshot;
  return options;
}

}  // namespace locus::server
