#include "tests/bench/queries/contains_cases.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/geometry/point_in_mesh.h"
#include "core/mesh/open_edges.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/peer_library.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/queries/query_run.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::queries {
namespace {

constexpr size_t kPoints = 50'000, kQuickPoints = 600, kPointsAChunk = 5'000;
// Number of points whose answers are compared with those of proved().
constexpr size_t kProvedPoints = 20;

void append(Vec3f point, std::vector<float>& points) { points.insert(points.end(), {point.x, point.y, point.z}); }

// Returns random points of the bounds.
std::vector<float> points_in_bounds(const BenchMesh& mesh, size_t count) {
  std::vector<float> points;
  for (const RayQuery& ray : random_rays(mesh, count, 601, 1)) append(ray.origin, points);
  return points;
}

// Returns points 0.1 % of the diagonal away from points of the surface, in random directions.
std::vector<float> points_near_surface(const BenchMesh& mesh, size_t count) {
  std::vector<float> points;
  const std::vector<Ballf> on_surface = balls(mesh, 2 * count, 602, 0);  // the balls with even index are on the surface
  const std::vector<RayQuery> directions = random_rays(mesh, count, 603, 1);
  for (size_t i = 0; i < count; ++i)
    append(on_surface[2 * i].center + directions[i].direction * (0.001f * mesh.diagonal), points);
  return points;
}

// Returns corners of triangles in all parts of the mesh.
std::vector<float> points_at_corners(const BenchMesh& mesh, size_t count) {
  std::vector<float> points;
  for (size_t i = 0; i < count; ++i) append(mesh.triangles[i * 7919 % mesh.triangles.size()].a, points);
  return points;
}

struct ContainsCase {
  const char* name;
  std::vector<float> (*points)(const BenchMesh& mesh, size_t count);
  double bar;  // required ratio; 0 = none
};
constexpr ContainsCase kCases[] = {{"contains/bounds", points_in_bounds, 5},
                                   {"contains/surface", points_near_surface, 5},
                                   {"contains/corners", points_at_corners, 0}};

// Locus: the mesh as the only instance of a scene, queried by whole batches.
class OurPoints {
 public:
  explicit OurPoints(const BenchMesh& mesh) : snapshot_(scene_of(mesh)) {}

  void contains(absl::Span<const float> points, uint8_t* answers) const {
    QueryBlock block;
    block.kind = ContainsColumns{points};
    for (const uint32_t count : answer_of(*snapshot_, block).counts) *answers++ = static_cast<uint8_t>(count);
  }

 private:
  const SnapshotPtr snapshot_;
};

// Returns the answer for one point, computed from the crossing() of every triangle.
uint8_t proved(const BenchMesh& mesh, const float* point) {
  const Vec3d from = without_tiny_coordinates(read_vec3d(point));
  int64_t winding = 0;
  bool on_surface = false;
  for (const Triangle& triangle : mesh.triangles) {
    const Crossing found = crossing(from, triangle);
    winding += found.winding;
    on_surface |= found.on_surface;
  }
  return on_surface || winding != 0 ? 1 : 0;
}

// Compares answers with a test of all triangles and with those of the peer, if there is one.
void compare(const std::string& name, const BenchMesh& mesh, absl::Span<const float> points,
             absl::Span<const uint8_t> ours, absl::Span<const uint8_t> theirs, Report& report) {
  for (size_t i = 0; i < std::min(kProvedPoints, ours.size()); ++i)
    if (proved(mesh, &points[3 * i]) != ours[i])
      report.disagreements.push_back(
          absl::StrFormat("%s: point %d: %d, by all triangles %d", name, i, ours[i], proved(mesh, &points[3 * i])));
  size_t differing = 0;
  for (size_t i = 0; i < theirs.size(); ++i) differing += ours[i] != theirs[i] ? 1 : 0;
  if (differing != 0)
    report.disagreements.push_back(
        absl::StrFormat("%s: %d of %d answers of cgal, which is exact, differ", name, differing, theirs.size()));
  report.notes.push_back(absl::StrFormat("%s: the mesh contains %d of %d points", name,
                                         std::count(ours.begin(), ours.end(), 1), ours.size()));
}

void run_case(const Options& options, const ContainsCase& one, const BenchMesh& mesh, const OurPoints& ours,
              ContainsPeer* peer, Report& report) {
  const std::string name = absl::StrCat(one.name, "/", mesh.name);
  const std::vector<float> points = one.points(mesh, options.quick ? kQuickPoints : kPoints);
  const size_t count = points.size() / 3, a_chunk = std::min(count, kPointsAChunk), chunks = count / a_chunk;
  const auto part = [&](size_t chunk) { return absl::MakeConstSpan(points).subspan(3 * chunk * a_chunk, 3 * a_chunk); };
  std::vector<uint8_t> our_answers(count), their_answers(peer == nullptr ? 0 : count);
  const auto operations = static_cast<double>(count);
  std::vector<Contestant> contestants = {
      {"locus", [&](size_t chunk) { ours.contains(part(chunk), &our_answers[chunk * a_chunk]); }, operations, {}}};
  if (peer != nullptr)
    contestants.push_back(
        {"cgal", [&](size_t chunk) { peer->contains(part(chunk), &their_answers[chunk * a_chunk]); }, operations, {}});
  const auto times = race(contestants, chunks, options.rounds, thread_seconds);
  ResultsHash hash;
  for (const uint8_t answer : our_answers) hash.add(uint32_t{answer});
  add_cells(contestants, times, cell_of(name, "ns/point", hash), report);
  compare(name, mesh, points, our_answers, their_answers, report);
  if (peer != nullptr && one.bar != 0) note_bar(report, one.bar);
}

}  // namespace

void run_contains_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  std::unique_ptr<OurPoints> ours;
  std::unique_ptr<ContainsPeer> peer;
  for (const ContainsCase& one : kCases) {
    const std::string name = absl::StrCat(one.name, "/", mesh.name);
    if (!options.filter.wants(name)) continue;
    progress(name);
    if (ours == nullptr) {
      if (const uint64_t open = count_open_edges(mesh.vertices, mesh.indices); open != 0) {
        report.notes.push_back(absl::StrCat("contains: ", mesh.name, " is left out: it has ", open, " open edges"));
        return;
      }
      ours = std::make_unique<OurPoints>(mesh);
#if LOCUS_BENCH_CGAL
      peer = cgal_side(mesh);
      if (peer == nullptr)
        report.notes.push_back(absl::StrCat("contains: without cgal, because ", mesh.name, " is no manifold"));
#endif
    }
    run_case(options, one, mesh, *ours, peer.get(), report);
  }
}

}  // namespace locus::bench::queries
