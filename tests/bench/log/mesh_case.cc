#include "tests/bench/log/mesh_case.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/scene/recovery.h"
#include "core/scene/registry.h"
#include "server/scheduling/worker_pool.h"
#include "server/storage/rocksdb_log.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/statistics.h"
#include "tests/bench/frame/temporary_folder.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::log {
namespace {

constexpr const char* kName = "mesh/2M";

// Returns a hash of the triangles in storage order. Other tests verify the answers of trees restored from a topology.
uint64_t hash_of(const StaticMesh& mesh) {
  ResultsHash hash;
  mesh.tree().for_each([&hash](const Triangle& triangle) { hash.add(triangle.number); });
  return hash.value();
}

class MeshCase {
 public:
  MeshCase() {
    options_.path = folder_.file("data");
    bvh_options_.parallel_for = [this](size_t count, const std::function<void(size_t)>& work) {
      pool_.parallel_for(count, work);
    };
  }

  // Adds the mesh `name` to a new data directory, then closes and reopens the directory.
  absl::Status prepare(const std::string& name) {
    const absl::StatusOr<BenchMesh> level = load_mesh(name);
    if (!level.ok()) return level.status();
    absl::StatusOr<TriangleMesh> mesh = TriangleMesh::create(level->vertices, level->indices, {});
    if (!mesh.ok()) return mesh.status();
    absl::StatusOr<MeshPtr> built = StaticMesh::build("level", {1}, *std::move(mesh), bvh_options_);
    if (!built.ok()) return built.status();
    if (absl::Status status = open(); !status.ok()) return status;
    if (absl::Status status = Registry(log_.get()).add_mesh("level", *std::move(built)).status(); !status.ok())
      return status;
    return open();
  }

  // Removes the stored topology and releases the mesh. Recovery must then build the tree, as it must for a directory of
  // an earlier version, which stored no topology.
  void forget_topology() {
    topology_ = log_->read_topology({1}).value_or("");
    log_->store_topology({1}, "");
    mesh_ = nullptr;
  }
  void forget_mesh() { mesh_ = nullptr; }
  void recover(bool should_build) {
    absl::StatusOr<RecoveredMesh> recovered = recover_mesh(*log_, log_->stored_meshes().front(), bvh_options_);
    status_.Update(recovered.status());
    if (!recovered.ok()) return;
    if (recovered->built != should_build) status_.Update(absl::InternalError("the tree came from elsewhere"));
    mesh_ = std::move(recovered->mesh);
  }

  const absl::Status& status() const { return status_; }
  // Returns the mesh of the last recover(); null if it was released since.
  const MeshPtr& mesh() const { return mesh_; }
  size_t topology_bytes() const { return topology_.size(); }

 private:
  absl::Status open() {
    log_ = nullptr;
    auto log = server::RocksdbLog::open(options_);
    if (log.ok()) log_ = *std::move(log);
    return log.status();
  }

  static constexpr uint32_t kThreads = 2;

  TemporaryFolder folder_;
  server::StorageOptions options_;
  server::WorkerPool pool_{kThreads};
  BvhOptions bvh_options_;
  std::unique_ptr<UpdateLog> log_;
  std::string topology_;
  MeshPtr mesh_;
  absl::Status status_;
};

}  // namespace

absl::Status measure_mesh(const LogRun& run) {
  if (!run.options.filter.wants(kName)) return absl::OkStatus();
  run.progress(kName);
  MeshCase mesh;
  if (absl::Status status = mesh.prepare(run.options.quick ? "terrain:20000" : "terrain:2000000"); !status.ok())
    return status;
  const std::vector<Contestant> contestants = {
      {"restored", [&](size_t) { mesh.recover(false); }, 1, [&](size_t) { mesh.forget_mesh(); }},
      {"built", [&](size_t) { mesh.recover(true); }, 1, [&](size_t) { mesh.forget_topology(); }}};
  const auto times = race(contestants, 1, run.options.rounds, wall_seconds);
  if (!mesh.status().ok()) return mesh.status();
  const uint64_t built = hash_of(*mesh.mesh());
  mesh.recover(false);
  if (!mesh.status().ok()) return mesh.status();
  const uint64_t restored = hash_of(*mesh.mesh());
  if (restored != built) run.report.disagreements.push_back(absl::StrCat(kName, ": not the tree that is built"));
  ResultsHash hash;
  hash.add(built);
  add_cells(contestants, times, cell_of(kName, "ns", hash), run.report);
  run.report.notes.push_back(absl::StrFormat(
      "%s: %.3f s restored, %.3f s built, %.1f bytes of topology a triangle", kName, 1e-9 * median(times[0]),
      1e-9 * median(times[1]), static_cast<double>(mesh.topology_bytes()) / mesh.mesh()->triangle_count()));
  return absl::OkStatus();
}

}  // namespace locus::bench::log
