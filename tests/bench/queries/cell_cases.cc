#include "tests/bench/queries/cell_cases.h"

#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/queries/query_run.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::queries {
namespace {

constexpr uint32_t kPlanes = 32;
constexpr size_t kPoints = 1'000, kQuickPoints = 20;
// Number of cells that are verified by a test of all triangles or objects.
constexpr size_t kProvedCells = 10;
constexpr float kDistance = 0.05f;  // distance at which the cells end, as a part of the mesh's diagonal
constexpr uint64_t kSeed = 521;

test::BlockResult answer(const CellWork& work, size_t points, bool brute_force) {
  QueryBlock block;
  block.kind = CellColumns{absl::MakeConstSpan(work.points).first(3 * points), {&work.distance, 1}, kPlanes};
  block.source = work.source;
  return answer_of(*work.snapshot, std::move(block), brute_force);
}

}  // namespace

void run_cells(const Options& options, const std::string& name, const CellWork& work, Report& report) {
  const size_t points = work.points.size() / 3, proved_points = std::min(points, kProvedCells);
  test::BlockResult ours, proved;
  const std::vector<Contestant> contestants = {
      {"locus", [&](size_t) { ours = answer(work, points, false); }, static_cast<double>(points), {}},
      {"list", [&](size_t) { proved = answer(work, proved_points, true); }, static_cast<double>(proved_points), {}}};
  const auto times = race(contestants, 1, options.rounds, thread_seconds);
  ResultsHash hash;
  for (size_t i = 0; i < ours.ids.size(); ++i) {
    hash.add(ours.ids[i]);
    hash.add(std::bit_cast<uint32_t>(ours.t[i]));
  }
  add_cells(contestants, times, cell_of(name, "ns/cell", hash), report);
  const auto begins_with = [](const auto& all, const auto& part) {
    return all.size() >= part.size() && std::equal(part.begin(), part.end(), all.begin());
  };
  if (!begins_with(ours.counts, proved.counts) || !begins_with(ours.ids, proved.ids) ||
      !begins_with(ours.triangles, proved.triangles) || !begins_with(ours.t, proved.t))
    report.disagreements.push_back(absl::StrCat(name, ": not the cells of a test of all values"));
  report.notes.push_back(absl::StrFormat("%s: %d cells have %d rows", name, points, ours.ids.size()));
}

void run_cell_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  const std::string name = absl::StrCat("cell/32/", mesh.name);
  if (!options.filter.wants(name)) return;
  progress(name);
  CellWork work{scene_of(mesh), Source::kStatic, {}, kDistance * mesh.diagonal};
  for (const RayQuery& ray : random_rays(mesh, options.quick ? kQuickPoints : kPoints, kSeed, 1))
    work.points.insert(work.points.end(), {ray.origin.x, ray.origin.y, ray.origin.z});
  run_cells(options, name, work, report);
}

}  // namespace locus::bench::queries
