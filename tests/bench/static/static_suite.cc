#include "tests/bench/static/static_suite.h"

#include <sys/stat.h>

#include "core/index/bvh/kernels/dispatch.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/bench/static/build_cases.h"
#include "tests/bench/static/ours.h"
#include "tests/bench/static/peers.h"
#include "tests/bench/static/ray_cases.h"
#include "tests/bench/static/region_cases.h"

namespace locus::bench {
namespace {

// From a box town in the first cache to a body beyond the last.
const std::vector<std::string> kGenerated = {"city:10000", "city:70000", "terrain:270000", "blob:4300000"};
const std::vector<std::string> kQuick = {"city:2000", "blob:5000"};

// A level that comes in a Debian package, as fetch_levels.sh leaves it.
struct Fetched {
  const char* name;
  const char* file;
  const char* entry;  // with its mark; empty = none
};
constexpr Fetched kFetched[] = {{"delta", "pak1-maps.pk3", "#maps/delta.bsp"}, {"bunny", "bunny.obj", ""}};

std::vector<std::string> meshes_of(const Options& options, Report& report) {
  if (!options.meshes.empty()) return options.meshes;
  if (options.quick) return kQuick;
  std::vector<std::string> meshes = kGenerated;
  for (const Fetched& level : kFetched) {
    const std::string path = absl::StrCat(options.levels, "/", level.file);
    struct stat facts {};
    if (stat(path.c_str(), &facts) == 0)
      meshes.push_back(path + level.entry);
    else
      report.notes.push_back(
          absl::StrCat("the level ", level.name, " is left out: no ", path, "; run tests/bench/fetch_levels.sh"));
  }
  return meshes;
}

void run_mesh(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  Needs needs;
  needs.rays = wants_ray_peers(options, mesh);
  needs.regions = wants_region_peers(options, mesh);
  Ours ours(mesh);
  const Peers peers = all_peers(mesh, needs);
  const MeshRun run{options, progress, mesh, ours, peers, report};
  run_ray_cases(run);
  run_threads_case(run);
  run_region_cases(run);
  run_build_cases(run);
}

}  // namespace

absl::StatusOr<Report> run_static_suite(const Options& options, const Progress& progress) {
  Report report;
  report.notes = missing_peers();
  const absl::string_view instructions = instruction_set();
  report.notes.push_back(absl::StrCat("our kernels: ", instructions));
  for (const std::string& name : meshes_of(options, report)) {
    progress(absl::StrCat("mesh ", name));
    const absl::StatusOr<BenchMesh> mesh = load_mesh(name);
    if (!mesh.ok()) return mesh.status();
    report.notes.push_back(absl::StrCat("mesh ", mesh->name, ": ", mesh->triangles.size(), " triangles"));
    run_mesh(options, progress, *mesh, report);
  }
  return report;
}

}  // namespace locus::bench
