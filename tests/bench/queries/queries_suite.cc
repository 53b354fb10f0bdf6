#include "tests/bench/queries/queries_suite.h"

#include "absl/strings/str_cat.h"
#include "tests/bench/frame/peer_library.h"
#include "tests/bench/queries/cell_cases.h"
#include "tests/bench/queries/contains_cases.h"
#include "tests/bench/queries/lidar_cases.h"
#include "tests/bench/queries/nearest_cases.h"
#include "tests/bench/queries/object_cases.h"
#include "tests/bench/queries/overlap_cases.h"
#include "tests/bench/queries/sight_cases.h"
#include "tests/bench/queries/sweep_cases.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/bench/static/mesh_list.h"

namespace locus::bench::queries {

absl::Status run_queries_suite(const Options& options, const Progress& progress, Report& report) {
  report.notes = missing_peers({kBullet, kEmbree, kCgal});
  for (const std::string& name : meshes_of(options, report.notes)) {
    progress(absl::StrCat("mesh ", name));
    const absl::StatusOr<BenchMesh> mesh = load_mesh(name);
    if (!mesh.ok()) return mesh.status();
    report.notes.push_back(absl::StrCat("mesh ", mesh->name, ": ", mesh->triangles.size(), " triangles"));
    run_sweep_cases(options, progress, *mesh, report);
    run_contains_cases(options, progress, *mesh, report);
    run_cell_cases(options, progress, *mesh, report);
    run_sight_cases(options, progress, *mesh, report);
    run_lidar_cases(options, progress, *mesh, report);
    run_nearest_cases(options, progress, *mesh, report);
    run_overlap_cases(options, progress, *mesh, report);
  }
  run_object_cases(options, progress, report);
  return absl::OkStatus();
}

}  // namespace locus::bench::queries
