#include "tests/bench/queries/nearest_cases.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/check.h"
#include "core/geometry/point_triangle.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/peer_library.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/queries/query_run.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::queries {
namespace {

constexpr size_t kPoints = 100'000, kQuickPoints = 600, kPointsAChunk = 1'000;
// Number of points whose answers are compared with a test of every triangle.
constexpr size_t kProvedPoints = 20;
constexpr double kBar = 2;

// Regions from which the points of a case are drawn.
enum class Place {
  kAnywhere,     // in the bounds of the mesh
  kNearSurface,  // 1 % of the diagonal away from a point of the surface
};
struct NearestCase {
  const char* name;
  Place place;
  uint64_t seed;
};
constexpr NearestCase kCases[] = {{"nearest/anywhere", Place::kAnywhere, 601},
                                  {"nearest/surface", Place::kNearSurface, 602}};

std::vector<Vec3f> points_of(const NearestCase& one, const BenchMesh& mesh, size_t count) {
  const std::vector<RayQuery> rays = random_rays(mesh, count, one.seed, 1);
  std::vector<Vec3f> points;
  points.reserve(count);
  for (const RayQuery& ray : rays) points.push_back(ray.origin);
  if (one.place == Place::kAnywhere) return points;
  // Only the balls with even index have their centre on the surface.
  const std::vector<Ballf> on_surface = balls(mesh, 2 * count, one.seed, 0);
  for (size_t i = 0; i < count; ++i) points[i] = on_surface[2 * i].center + rays[i].direction * (0.01f * mesh.diagonal);
  return points;
}

// Locus: the mesh as the only instance of a scene, queried by whole batches.
class OurScene {
 public:
  explicit OurScene(const BenchMesh& mesh) : snapshot_(scene_of(mesh)) {}

  void nearest(absl::Span<const Vec3f> points, NearestTriangle* answers) const {
    NearestColumns columns;
    columns.points = {&points[0].x, 3 * points.size()};
    const test::BlockResult result = run(columns, {});
    LOCUS_CHECK_EQ(result.t.size(), points.size());
    for (size_t i = 0; i < points.size(); ++i) answers[i] = {result.t[i], result.triangles[i]};
  }

  // Returns the number of rows that a query of balls of one radius finds. `wanted` are the columns of the rows.
  size_t overlaps(absl::Span<const Vec3f> centers, float radius, ColumnSet wanted, StaticDetail detail) const {
    BallColumns columns;
    columns.centers = {&centers[0].x, 3 * centers.size()};
    columns.radii = {&radius, 1};
    columns.detail = detail;
    return run(columns, wanted).ids.size();
  }

 private:
  template <class Columns>
  test::BlockResult run(const Columns& columns, ColumnSet wanted) const {
    QueryBlock block;
    block.kind = columns;
    block.columns = wanted;
    return answer_of(*snapshot_, std::move(block));
  }

  const SnapshotPtr snapshot_;
};

// Returns the nearest triangle, found by testing every triangle. The distance is rounded to float before the
// comparison, as in the rows of a reply.
NearestTriangle proved(const BenchMesh& mesh, Vec3f point) {
  NearestTriangle best{std::numeric_limits<float>::infinity(), kNoTriangle};
  for (const Triangle& triangle : mesh.triangles) {
    const auto distance = static_cast<float>(locus::distance(to_double(point), triangle));
    if (distance < best.distance) best = {distance, triangle.number};
  }
  return best;
}

void check(const std::string& name, const BenchMesh& mesh, absl::Span<const Vec3f> points,
           const std::vector<NearestTriangle>& ours, Report& report) {
  for (size_t i = 0; i < std::min(kProvedPoints, points.size()); ++i) {
    const NearestTriangle expected = proved(mesh, points[i]);
    if (expected.distance == ours[i].distance && expected.triangle == ours[i].triangle) continue;
    report.disagreements.push_back(absl::StrFormat("%s: point %d: triangle %d at %g, a test of all triangles %d at %g",
                                                   name, i, ours[i].triangle, ours[i].distance, expected.triangle,
                                                   expected.distance));
  }
}

// Notes how many distances of a peer differ from ours by more than float rounding explains.
void compare(const std::string& name, const BenchMesh& mesh, const std::vector<NearestTriangle>& ours,
             const std::vector<NearestTriangle>& theirs, Report& report) {
  size_t differing = 0;
  for (size_t i = 0; i < ours.size(); ++i)
    differing += std::abs(ours[i].distance - theirs[i].distance) > 1e-5f * (mesh.diagonal + ours[i].distance);
  report.notes.push_back(absl::StrFormat("%s: %d of %d distances of embree differ", name, differing, ours.size()));
}

void run_case(const Options& options, const NearestCase& one, const BenchMesh& mesh, const OurScene& ours,
              NearestPeer* peer, Report& report) {
  const std::string name = absl::StrCat(one.name, "/", mesh.name);
  const std::vector<Vec3f> points = points_of(one, mesh, options.quick ? kQuickPoints : kPoints);
  const size_t chunks = std::max<size_t>(1, points.size() / kPointsAChunk), a_chunk = points.size() / chunks;
  std::vector<NearestTriangle> our_answers(chunks * a_chunk), their_answers(our_answers.size());
  const auto part = [&](size_t chunk) { return absl::MakeConstSpan(points).subspan(chunk * a_chunk, a_chunk); };
  const auto operations = static_cast<double>(our_answers.size());
  std::vector<Contestant> contestants = {
      {"locus", [&](size_t chunk) { ours.nearest(part(chunk), &our_answers[chunk * a_chunk]); }, operations, {}}};
  if (peer != nullptr)
    contestants.push_back(
        {"embree", [&](size_t chunk) { peer->nearest(part(chunk), &their_answers[chunk * a_chunk]); }, operations, {}});
  const auto times = race(contestants, chunks, options.rounds, thread_seconds);
  ResultsHash hash;
  for (const NearestTriangle& answer : our_answers) {
    hash.add(std::bit_cast<uint32_t>(answer.distance));
    hash.add(answer.triangle);
  }
  add_cells(contestants, times, cell_of(name, "ns/point", hash), report);
  check(name, mesh, points, our_answers, report);
  if (peer == nullptr) return;
  note_bar(report, kBar);
  compare(name, mesh, our_answers, their_answers, report);
}

// Measures balls with radii of 1.5 % of the diagonal around points near the surface: rows with the columns of contacts,
// compared with the same rows without these columns.
void run_contact_case(const Options& options, StaticDetail detail, const std::string& name, const BenchMesh& mesh,
                      const OurScene& ours, Report& report) {
  const std::vector<Vec3f> points =
      points_of({"", Place::kNearSurface, 603}, mesh, options.quick ? kQuickPoints : kPoints / 5);
  const size_t chunks = std::max<size_t>(1, points.size() / kPointsAChunk), a_chunk = points.size() / chunks;
  const float radius = 0.015f * mesh.diagonal;
  size_t rows = 0;
  const auto run = [&](ColumnSet wanted) {
    return [&, wanted](size_t chunk) {
      rows = ours.overlaps(absl::MakeConstSpan(points).subspan(chunk * a_chunk, a_chunk), radius, wanted, detail);
    };
  };
  const auto operations = static_cast<double>(chunks * a_chunk);
  const std::vector<Contestant> contestants = {
      {"locus", run({Column::kId, Column::kTriangle, Column::kT, Column::kPoint, Column::kNormal}), operations, {}},
      {"no_contacts", run({Column::kId, Column::kTriangle}), operations, {}}};
  const auto times = race(contestants, chunks, options.rounds, thread_seconds);
  Cell cell;
  cell.suite = "queries";
  cell.case_name = name;
  cell.metric = "ns/ball";
  add_cells(contestants, times, cell, report);
  report.notes.push_back(absl::StrFormat("%s: %d rows of the last %d balls", name, rows, a_chunk));
}

}  // namespace

void run_nearest_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  std::unique_ptr<OurScene> ours;
  std::unique_ptr<NearestPeer> peer;
  const auto wanted = [&](const std::string& name) {
    if (!options.filter.wants(name)) return false;
    progress(name);
    if (ours == nullptr) ours = std::make_unique<OurScene>(mesh);
    return true;
  };
  for (const NearestCase& one : kCases) {
    if (!wanted(absl::StrCat(one.name, "/", mesh.name))) continue;
#if LOCUS_BENCH_EMBREE
    if (peer == nullptr) peer = embree_nearest(mesh);
#endif
    run_case(options, one, mesh, *ours, peer.get(), report);
  }
  for (const auto& [kind, detail] :
       {std::pair{"instances", StaticDetail::kInstances}, std::pair{"triangles", StaticDetail::kTriangles}}) {
    const std::string name = absl::StrCat("contacts/", kind, "/", mesh.name);
    if (wanted(name)) run_contact_case(options, detail, name, mesh, *ours, report);
  }
}

}  // namespace locus::bench::queries
