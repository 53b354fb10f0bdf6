#include "tests/bench/queries/sweep_cases.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/geometry/sweep.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/peer_library.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/queries/query_run.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::queries {
namespace {

struct SweepCase {
  const char* name;
  MoverKind kind;
  float size;  // radius or half extent, as a part of the mesh's diagonal
  float way;   // length of the sweep, as a part of the mesh's diagonal
  uint64_t seed;
  double bar;
};
constexpr SweepCase kCases[] = {
    {"sweep/ball/0.1/2", MoverKind::kBall, 0.001f, 0.02f, 501, 5},
    {"sweep/ball/0.1/20", MoverKind::kBall, 0.001f, 0.2f, 502, 5},
    {"sweep/ball/0.5/2", MoverKind::kBall, 0.005f, 0.02f, 503, 5},
    {"sweep/ball/0.5/20", MoverKind::kBall, 0.005f, 0.2f, 504, 5},
    {"sweep/ball/2/2", MoverKind::kBall, 0.02f, 0.02f, 505, 5},
    {"sweep/ball/2/20", MoverKind::kBall, 0.02f, 0.2f, 506, 5},
    {"sweep/capsule/0.5/2", MoverKind::kCapsule, 0.005f, 0.02f, 507, 3},
    {"sweep/capsule/0.5/20", MoverKind::kCapsule, 0.005f, 0.2f, 508, 3},
    {"sweep/box/0.5/2", MoverKind::kBox, 0.005f, 0.02f, 509, 3},
    {"sweep/box/0.5/20", MoverKind::kBox, 0.005f, 0.2f, 510, 3},
};
constexpr size_t kSweeps = 20'000, kQuickSweeps = 300, kSweepsAChunk = 1'000, kSweepsAPeer = 8;
// Number of sweeps whose answers are compared with a test of every triangle.
constexpr size_t kProvedSweeps = 20;

// Returns the sweeps of a case: from random points of the bounds in random directions.
SweepWork work_of(const SweepCase& one, const BenchMesh& mesh, size_t count) {
  SweepWork work;
  work.solid.kind = one.kind;
  const double size = one.size * mesh.diagonal;
  if (one.kind != MoverKind::kBox) work.solid.radius = size;
  if (one.kind == MoverKind::kCapsule) work.solid.half_axis = {0, static_cast<float>(2 * size), 0};
  if (one.kind == MoverKind::kBox) work.solid.half = {size, size, size};
  for (const RayQuery& ray : random_rays(mesh, count, one.seed, 1)) {
    const Vec3f end = ray.origin + ray.direction * (one.way * mesh.diagonal);
    work.starts.insert(work.starts.end(), {ray.origin.x, ray.origin.y, ray.origin.z});
    work.ends.insert(work.ends.end(), {end.x, end.y, end.z});
  }
  return work;
}

// Locus: the mesh as the only instance of a scene, queried by whole batches.
class OurSweeps {
 public:
  explicit OurSweeps(const BenchMesh& mesh) : snapshot_(scene_of(mesh)) {}

  void sweep(const SweepWork& work, size_t begin, size_t end, SweepHit* hits) const {
    const float radius = static_cast<float>(work.solid.radius);
    const Vec3f axis = to_float(work.solid.half_axis), half = to_float(work.solid.half);
    SweepColumns columns;
    columns.starts = absl::MakeConstSpan(work.starts).subspan(3 * begin, 3 * (end - begin));
    columns.ends = absl::MakeConstSpan(work.ends).subspan(3 * begin, 3 * (end - begin));
    if (work.solid.kind != MoverKind::kBox) columns.radii = {&radius, 1};
    if (work.solid.kind == MoverKind::kCapsule) columns.half_axes = {&axis.x, 3};
    if (work.solid.kind == MoverKind::kBox) columns.half_extents = {&half.x, 3};
    columns.at_start = AtStart::kPass;
    QueryBlock block;
    block.kind = columns;
    const test::BlockResult result = answer_of(*snapshot_, std::move(block));
    for (size_t i = begin; i < end; ++i) hits[i].t = std::min(result.t[i - begin], 2.0f);
  }

 private:
  const SnapshotPtr snapshot_;
};

// Returns the first contact of sweep `i`, found by testing every triangle.
float proved(const BenchMesh& mesh, const SweepWork& work, size_t i) {
  Mover mover = work.solid;
  mover.start = read_vec3d(&work.starts[3 * i]);
  mover.way = read_vec3d(&work.ends[3 * i]) - mover.start;
  mover.radius = static_cast<float>(mover.radius);
  mover.half = to_double(to_float(mover.half));
  double best = 2;
  for (const Triangle& triangle : mesh.triangles)
    best = std::min(best, first_contact(mover, corners_of(triangle), AtStart::kPass).value_or(2));
  return static_cast<float>(best);
}

void run_case(const Options& options, const SweepCase& one, const BenchMesh& mesh, const OurSweeps& ours,
              SweepPeer* peer, Report& report) {
  const std::string name = absl::StrCat(one.name, "/", mesh.name);
  const SweepWork work = work_of(one, mesh, options.quick ? kQuickSweeps : kSweeps);
  const size_t chunks = std::max<size_t>(1, work.size() / kSweepsAChunk), a_chunk = work.size() / chunks;
  std::vector<SweepHit> our_hits(work.size()), their_hits(work.size());
  const auto run_ours = [&](size_t chunk) {
    ours.sweep(work, chunk * a_chunk, (chunk + 1) * a_chunk, our_hits.data());
  };
  std::vector<Contestant> contestants = {{"locus", run_ours, static_cast<double>(a_chunk * chunks), {}}};
  const size_t their_part = std::max<size_t>(1, a_chunk / kSweepsAPeer);
  if (peer != nullptr) {
    const auto run_theirs = [&](size_t chunk) {
      peer->sweep(work, chunk * a_chunk, chunk * a_chunk + their_part, their_hits.data());
    };
    contestants.push_back({"bullet", run_theirs, static_cast<double>(their_part * chunks), {}});
  }
  const auto times = race(contestants, chunks, options.rounds, thread_seconds);
  ResultsHash hash;
  size_t hits = 0, compared = 0, differing = 0;
  for (const SweepHit& hit : our_hits) {
    hash.add(std::bit_cast<uint32_t>(hit.t));
    hits += hit.t <= 1;
  }
  add_cells(contestants, times, cell_of(name, "ns/sweep", hash), report);
  for (size_t i = 0; i < std::min(kProvedSweeps, work.size()); ++i)
    if (proved(mesh, work, i) != our_hits[i].t)
      report.disagreements.push_back(absl::StrFormat("%s: sweep %d hits at %g, a test of all triangles at %g", name, i,
                                                     our_hits[i].t, proved(mesh, work, i)));
  if (peer == nullptr) return;
  note_bar(report, one.bar);
  for (size_t chunk = 0; chunk < chunks; ++chunk) {
    for (size_t i = chunk * a_chunk; i < chunk * a_chunk + their_part; ++i) {
      ++compared;
      // Bullet stops before the contact by a margin of its own.
      differing += std::abs(our_hits[i].t - their_hits[i].t) > 0.02f * (1 + one.size / one.way);
    }
  }
  report.notes.push_back(absl::StrFormat("%s: %d of %d sweeps hit; %d of %d answers of bullet differ", name, hits,
                                         work.size(), differing, compared));
}

}  // namespace

void run_sweep_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  std::unique_ptr<OurSweeps> ours;
  std::unique_ptr<SweepPeer> peer;
  for (const SweepCase& one : kCases) {
    const std::string name = absl::StrCat(one.name, "/", mesh.name);
    if (!options.filter.wants(name)) continue;
    progress(name);
    if (ours == nullptr) {
      ours = std::make_unique<OurSweeps>(mesh);
#if LOCUS_BENCH_BULLET
      peer = bullet_sweeps(mesh);
#endif
    }
    run_case(options, one, mesh, *ours, peer.get(), report);
  }
}

}  // namespace locus::bench::queries
