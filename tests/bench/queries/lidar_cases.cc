#include "tests/bench/queries/lidar_cases.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/levels/generate/splitmix64.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/peer_library.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/queries/query_run.h"

namespace locus::bench::queries {
namespace {

constexpr size_t kBoxCounts[] = {0, 500, 5'000};
constexpr size_t kBeams = 128, kAngles = 1024, kQuickAngles = 32;
constexpr size_t kMaxRaysAChunk = 65'536;  // of one batch: half a turn
constexpr double kHeightOfView = 45;       // degrees between the highest and the lowest beam
constexpr float kReach = 1e30f;
constexpr double kBar = 1;
constexpr double kMaxAddedBy500 = 80;  // most nanoseconds that 500 boxes may add to a ray
// Part of the rays whose answers are compared with a test of all triangles and objects.
constexpr size_t kProvedRays = 128;

// Returns a point in front of a triangle drawn at random, at 0.4 % of the diagonal.
Vec3f sensor_of(const BenchMesh& mesh) {
  const Triangle& triangle = mesh.triangles[cli::SplitMix64(801).next() % mesh.triangles.size()];
  const Vec3d center = (to_double(triangle.a) + to_double(triangle.b) + to_double(triangle.c)) * (1.0 / 3);
  return to_float(center + normalized(area_normal(triangle)) * (0.004 * double{mesh.diagonal}));
}

// Returns the axis along which the mesh is shortest. The sensor turns around this axis.
int up_axis_of(const BenchMesh& mesh) {
  const Vec3f extent = mesh.bounds.extent();
  return extent.x < extent.y && extent.x < extent.z ? 0 : extent.y < extent.z ? 1 : 2;
}

// Returns the rays of one turn of the sensor: at each angle the beams from low to high.
std::vector<RayQuery> turn(Vec3f origin, int up_axis, size_t angles) {
  constexpr double kPi = 3.14159265358979;
  std::vector<RayQuery> rays;
  for (size_t angle = 0; angle < angles; ++angle) {
    const double around = 2 * kPi * static_cast<double>(angle) / static_cast<double>(angles);
    for (size_t beam = 0; beam < kBeams; ++beam) {
      const double up = ((static_cast<double>(beam) + 0.5) / kBeams - 0.5) * kHeightOfView * kPi / 180;
      Vec3d direction;
      direction[(up_axis + 1) % 3] = std::cos(up) * std::cos(around);
      direction[(up_axis + 2) % 3] = std::cos(up) * std::sin(around);
      direction[up_axis] = std::sin(up);
      rays.push_back({origin, kReach, to_float(direction)});
    }
  }
  return rays;
}

// Returns boxes near the surface, about as large as people and cars in a level. None holds the sensor.
std::vector<LidarBox> boxes_of(const BenchMesh& mesh, size_t count, Vec3f sensor) {
  std::vector<LidarBox> boxes;
  const std::vector<Obbf> drawn = locus::bench::boxes(mesh, 4 * count, 802, 0.002f);
  for (size_t i = 0; i < drawn.size() && boxes.size() < count; i += 2) {
    const Vec3f away = abs(sensor - drawn[i].center) - drawn[i].half;
    if (max_component(away) > 0) boxes.push_back({drawn[i].center, drawn[i].half});
  }
  return boxes;
}

SnapshotPtr snapshot_of(const BenchMesh& mesh, const std::vector<LidarBox>& boxes) {
  test::PlacedMesh placed;
  placed.id = 1;
  placed.mesh = test::mesh_of(mesh.triangles);
  test::QueryWorld world;
  world.instances = {placed};
  for (size_t i = 0; i < boxes.size(); ++i) {
    Object object;
    object.id = 2 + i;
    object.layers = kDefaultLayers;
    object.shape.kind = ShapeKind::kBox;
    object.shape.position = to_double(boxes[i].center);
    object.shape.size = boxes[i].half;
    world.objects.push_back(object);
  }
  return test::snapshot_of(world);
}

// Answers rays [begin, end) by whole batches, as the server does.
class OurLidar {
 public:
  OurLidar(SnapshotPtr snapshot, const std::vector<RayQuery>& rays) : snapshot_(std::move(snapshot)) {
    for (const RayQuery& ray : rays) {
      origins_.insert(origins_.end(), {ray.origin.x, ray.origin.y, ray.origin.z});
      directions_.insert(directions_.end(), {ray.direction.x, ray.direction.y, ray.direction.z});
    }
  }

  void first(size_t begin, size_t end, LidarHit* hits, bool brute_force = false) const {
    RayColumns columns;
    columns.origins = absl::MakeConstSpan(origins_).subspan(3 * begin, 3 * (end - begin));
    columns.directions = absl::MakeConstSpan(directions_).subspan(3 * begin, 3 * (end - begin));
    QueryBlock block;
    block.kind = columns;
    block.columns = {Column::kId, Column::kT};
    const test::BlockResult result = answer_of(*snapshot_, std::move(block), brute_force);
    for (size_t i = 0; i < end - begin; ++i) hits[i] = {result.t[i], result.ids[i] > 1};
  }

 private:
  const SnapshotPtr snapshot_;
  std::vector<float> origins_, directions_;
};

void check(const std::string& name, const OurLidar& ours, const std::vector<LidarHit>& hits, Report& report) {
  std::vector<LidarHit> proved(1);
  for (size_t i = 0; i < hits.size(); i += hits.size() / kProvedRays) {
    ours.first(i, i + 1, proved.data(), true);
    if (proved[0].t == hits[i].t && proved[0].on_box == hits[i].on_box) continue;
    report.disagreements.push_back(
        absl::StrFormat("%s: ray %d hits at %g, a test of everything at %g", name, i, hits[i].t, proved[0].t));
  }
}

// Runs the case with `box_count` boxes. Returns the nanoseconds of locus per ray.
double run_case(const Options& options, const std::string& name, const BenchMesh& mesh, size_t box_count,
                Report& report) {
  const Vec3f sensor = sensor_of(mesh);
  const std::vector<RayQuery> rays = turn(sensor, up_axis_of(mesh), options.quick ? kQuickAngles : kAngles);
  const std::vector<LidarBox> boxes = boxes_of(mesh, box_count, sensor);
  const OurLidar ours(snapshot_of(mesh, boxes), rays);
  const size_t rays_a_chunk = std::min(kMaxRaysAChunk, rays.size()), chunks = rays.size() / rays_a_chunk;
  std::vector<LidarHit> our_hits(rays.size());
  std::vector<Contestant> contestants = {{"locus",
                                          [&](size_t chunk) {
                                            ours.first(chunk * rays_a_chunk, (chunk + 1) * rays_a_chunk,
                                                       &our_hits[chunk * rays_a_chunk]);
                                          },
                                          static_cast<double>(rays.size()),
                                          {}}};
  std::vector<std::vector<LidarHit>> their_hits;
#if LOCUS_BENCH_EMBREE
  const std::vector<std::unique_ptr<LidarPeer>> peers = embree_lidars(mesh, boxes);
  their_hits.resize(peers.size(), our_hits);
  for (size_t i = 0; i < peers.size(); ++i) {
    const auto run = [&, i](size_t chunk) {
      peers[i]->first(absl::MakeConstSpan(rays).subspan(chunk * rays_a_chunk, rays_a_chunk),
                      &their_hits[i][chunk * rays_a_chunk]);
    };
    contestants.push_back({peers[i]->name(), run, static_cast<double>(rays.size()), {}});
  }
#endif
  const auto times = race(contestants, chunks, options.rounds, thread_seconds);
  ResultsHash hash;
  size_t on_boxes = 0, misses = 0;
  for (const LidarHit& hit : our_hits) {
    hash.add(std::bit_cast<uint32_t>(hit.t));
    on_boxes += hit.on_box;
    misses += std::isinf(hit.t);
  }
  add_cells(contestants, times, cell_of(name, "ns/ray", hash), report);
  check(name, ours, our_hits, report);
  report.notes.push_back(
      absl::StrFormat("%s: %d of %d rays hit a box, %d nothing", name, on_boxes, rays.size(), misses));
  for (size_t i = 0; i < their_hits.size(); ++i) {
    Report last;  // the bar holds beside each peer
    last.cells = {report.cells[report.cells.size() - their_hits.size() + i]};
    note_bar(last, kBar);
    report.notes.push_back(last.notes.back());
    size_t differing = 0;
    for (size_t k = 0; k < rays.size(); ++k) {
      const float one = std::min(our_hits[k].t, kReach), other = std::min(their_hits[i][k].t, kReach);
      differing += std::abs(one - other) > 1e-4f * (mesh.diagonal + one);
    }
    report.notes.push_back(
        absl::StrFormat("%s: %d of %d hits of %s differ", name, differing, rays.size(), contestants[i + 1].name));
  }
  std::vector<double> own = times[0];
  std::nth_element(own.begin(), own.begin() + static_cast<long>(own.size() / 2), own.end());
  return own[own.size() / 2];
}

}  // namespace

void run_lidar_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  double alone = 0;
  for (const size_t count : kBoxCounts) {
    const std::string name = absl::StrCat("lidar/", count, "/", mesh.name);
    if (!options.filter.wants(name)) continue;
    progress(name);
    const double nanoseconds = run_case(options, name, mesh, count, report);
    if (count == 0) alone = nanoseconds;
    if (count == 500 && alone != 0)
      report.notes.push_back(absl::StrFormat("%s: the boxes add %.0f ns to a ray, allowed %.0f: %s", name,
                                             nanoseconds - alone, kMaxAddedBy500,
                                             nanoseconds - alone <= kMaxAddedBy500 ? "shown" : "MISSED"));
  }
}

}  // namespace locus::bench::queries
