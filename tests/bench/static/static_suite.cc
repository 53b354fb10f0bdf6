#include "tests/bench/static/static_suite.h"

#include "core/index/bvh/kernels/dispatch.h"
#include "tests/bench/frame/peer_library.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/bench/static/build_cases.h"
#include "tests/bench/static/mesh_list.h"
#include "tests/bench/static/ours.h"
#include "tests/bench/static/peers.h"
#include "tests/bench/static/ray_cases.h"
#include "tests/bench/static/region_cases.h"

namespace locus::bench {
namespace {

void run_mesh(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  Needs needs;
  needs.rays = wants_ray_peers(options, mesh);
  needs.regions = wants_region_peers(options, mesh);
  Ours ours(mesh);
  const Peers peers = all_peers(mesh, needs, report.notes);
  const MeshRun run{options, progress, mesh, ours, peers, report};
  run_ray_cases(run);
  run_threads_case(run);
  run_region_cases(run);
  run_build_cases(run);
}

}  // namespace

absl::Status run_static_suite(const Options& options, const Progress& progress, Report& report) {
  report.notes = missing_peers({kEmbree, kBullet, kBoost, kCgal});
  const absl::string_view instructions = instruction_set();
  report.notes.push_back(absl::StrCat("our kernels: ", instructions));
  for (const std::string& name : meshes_of(options, report.notes)) {
    progress(absl::StrCat("mesh ", name));
    const absl::StatusOr<BenchMesh> mesh = load_mesh(name);
    if (!mesh.ok()) return mesh.status();
    report.notes.push_back(absl::StrCat("mesh ", mesh->name, ": ", mesh->triangles.size(), " triangles"));
    run_mesh(options, progress, *mesh, report);
  }
  return absl::OkStatus();
}

}  // namespace locus::bench
