#include "tests/bench/queries/sight_cases.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/levels/generate/splitmix64.h"
#include "core/base/check.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/queries/query_run.h"
#include "tests/support/query_world.h"
#include "tests/support/run_batch.h"

namespace locus::bench::queries {
namespace {

// Positions of viewers and targets. kSurface: close to the front of the surface, where most lines of sight are blocked
// if the mesh has rooms or buildings. kAround: around the mesh. kAbove: above the mesh, where nothing is blocked.
enum class Place : uint8_t { kSurface, kAround, kAbove };

struct SightCase {
  const char* name;
  Place place;
  size_t viewers, targets;
  bool pairwise;
  size_t copies;   // number of copies of the mesh, side by side
  size_t objects;  // number of balls near the surface
  uint64_t seed;
};
constexpr SightCase kCases[] = {
    {"sight/surface", Place::kSurface, 100, 100, false, 1, 0, 601},
    {"sight/around", Place::kAround, 100, 100, false, 1, 0, 602},
    {"sight/above", Place::kAbove, 100, 100, false, 1, 0, 603},
    {"sight/objects", Place::kSurface, 100, 100, false, 1, 100'000, 604},
    {"sight/copies16", Place::kSurface, 100, 100, false, 16, 0, 605},
    {"sight/few", Place::kSurface, 2500, 4, false, 1, 0, 606},
    {"sight/pairwise", Place::kSurface, 10'000, 10'000, true, 1, 0, 607},
};
constexpr size_t kSamples = 3, kQuickPart = 10;
// Required ratios: kBlockedBar if at least half of the segments are blocked and many segments begin at each eye,
// otherwise kOpenBar. In matrices of few targets, and in pairs, few segments begin at the same eye, so a query of sight
// saves nothing.
constexpr double kBlockedBar = 2, kOpenBar = 1;

// Generator of the points of a case. All coordinates are multiples of a power of two, so that the difference of two
// points is a float, and a ray's direction equals that of the segment.
class Points {
 public:
  Points(const BenchMesh& mesh, const SightCase& one) : mesh_(mesh), place_(one.place), numbers_(one.seed) {
    copies_a_side_ = std::max<size_t>(1, static_cast<size_t>(std::lround(std::sqrt(double(one.copies)))));
    grain_ = std::exp2(std::floor(std::log2(double{mesh.diagonal} * double(copies_a_side_))) - 18);
    double area = 0;
    for (const Triangle& triangle : mesh.triangles)
      areas_.push_back(area += std::sqrt(squared_length(area_normal(triangle))));
  }

  Vec3d translation(size_t copy) const {
    const Vec3d size = to_double(mesh_.bounds.max - mesh_.bounds.min);
    return {size.x * double(copy % copies_a_side_), size.y * double(copy / copies_a_side_), 0};
  }

  Vec3d next() {
    const Vec3d point = at_place();
    const size_t copies = copies_a_side_ * copies_a_side_;
    return rounded(copies == 1 ? point : point + translation(numbers_.next() % copies));
  }

  // Returns three points around `center`: low, in the middle, and high.
  std::array<Vec3d, kSamples> samples_around(Vec3d center) const {
    const Vec3d up{0, 0, mesh_.diagonal * 0.001};
    return {rounded(center - up), center, rounded(center + up)};
  }

  Vec3d on_surface(double distance) {
    const auto found = std::lower_bound(areas_.begin(), areas_.end(), unit() * areas_.back());
    const auto index = std::min<size_t>(static_cast<size_t>(found - areas_.begin()), areas_.size() - 1);
    const Triangle& triangle = mesh_.triangles[index];
    const double u = std::sqrt(unit()), w = unit();
    return to_double(triangle.a) * (1 - u) + to_double(triangle.b) * (u * (1 - w)) + to_double(triangle.c) * (u * w) +
           normalized(area_normal(triangle)) * distance;
  }

  double unit() { return static_cast<double>(numbers_.next() >> 40) * 0x1p-24; }

 private:
  Vec3d at_place() {
    const Vec3d low = to_double(mesh_.bounds.min), high = to_double(mesh_.bounds.max);
    const double diagonal = mesh_.diagonal;
    switch (place_) {
      case Place::kSurface:
        return on_surface(diagonal * 0.004);
      case Place::kAround:
        while (true) {
          const Vec3d way = Vec3d{unit(), unit(), unit()} * 2 - Vec3d{1, 1, 1};
          if (const double square = squared_length(way); square > 0.01 && square <= 1)
            return (low + high) * 0.5 + way * (0.6 * diagonal / std::sqrt(square));
        }
      case Place::kAbove:
        return {low.x + unit() * (high.x - low.x), low.y + unit() * (high.y - low.y),
                high.z + (0.01 + 0.2 * unit()) * diagonal};
    }
    LOCUS_CHECK(false);
    return {};
  }

  Vec3d rounded(Vec3d point) const {
    return {std::round(point.x / grain_) * grain_, std::round(point.y / grain_) * grain_,
            std::round(point.z / grain_) * grain_};
  }

  const BenchMesh& mesh_;
  const Place place_;
  cli::SplitMix64 numbers_;
  size_t copies_a_side_;
  double grain_;
  std::vector<double> areas_;
};

void append(Vec3d point, std::vector<float>& values) {
  for (const double value : {point.x, point.y, point.z}) values.push_back(static_cast<float>(value));
}

// One case: the scene, the matrix of sight, and the segments of the matrix as rays.
struct SightWork {
  SnapshotPtr snapshot;
  std::vector<float> viewers, targets;
  std::vector<float> origins, directions;
  float one = 1;
  QueryBatch sight, rays;
};

SnapshotPtr scene_of(const SightCase& one, const BenchMesh& mesh, size_t objects, Points& points) {
  test::QueryWorld world;
  const test::StaticMeshPtr shared = test::mesh_of(mesh.triangles);
  for (size_t copy = 0; copy < one.copies; ++copy) {
    test::PlacedMesh placed;
    placed.id = 1 + copy;
    placed.mesh = shared;
    placed.translation = points.translation(copy);
    world.instances.push_back(placed);
  }
  for (size_t i = 0; i < objects; ++i) {
    Object object;
    object.id = 1000 + i;
    object.layers = kDefaultLayers;
    object.shape.kind = ShapeKind::kBall;
    object.shape.position = points.on_surface(mesh.diagonal * 0.02 * points.unit());
    object.shape.radius = mesh.diagonal * 0.0005f;
    world.objects.push_back(object);
  }
  return test::snapshot_of(world);
}

void make_work(const SightCase& one, const BenchMesh& mesh, size_t part, SightWork& work) {
  Points points(mesh, one);
  work.snapshot = scene_of(one, mesh, one.objects / part, points);
  const size_t viewers = std::max<size_t>(1, one.viewers / part);
  const size_t targets = one.pairwise ? viewers : one.targets;
  for (size_t i = 0; i < viewers; ++i) append(points.next(), work.viewers);
  for (size_t i = 0; i < targets; ++i)
    for (const Vec3d& sample : points.samples_around(points.next())) append(sample, work.targets);
  for (size_t i = 0; i < viewers; ++i) {
    for (size_t k = one.pairwise ? kSamples * i : 0; k < (one.pairwise ? i + 1 : targets) * kSamples; ++k) {
      for (size_t axis = 0; axis < 3; ++axis) {
        work.origins.push_back(work.viewers[3 * i + axis]);
        work.directions.push_back(work.targets[3 * k + axis] - work.viewers[3 * i + axis]);
      }
    }
  }
  SightColumns sight;
  sight.viewers = work.viewers;
  sight.targets = work.targets;
  sight.samples = kSamples;
  sight.pairwise = one.pairwise;
  work.sight.blocks.emplace_back().kind = sight;
  RayColumns rays;
  rays.origins = work.origins;
  rays.directions = work.directions;
  rays.t_max = {&work.one, 1};
  rays.mode = RayMode::kAny;
  work.rays.blocks.emplace_back().kind = rays;
  LOCUS_CHECK(check_batch(work.sight).ok());
  LOCUS_CHECK(check_batch(work.rays).ok());
}

test::BlockResult answer(const SightWork& work, const QueryBatch& batch) {
  absl::StatusOr<test::BatchResult> result = test::run_batch(*work.snapshot, batch, {});
  LOCUS_CHECK(result.ok());
  return std::move(result->blocks[0]);
}

void run_case(const Options& options, const SightCase& one, const BenchMesh& mesh, Report& report) {
  const std::string name = absl::StrCat(one.name, "/", mesh.name);
  SightWork work;
  make_work(one, mesh, options.quick ? kQuickPart : 1, work);
  const auto segments = static_cast<double>(work.origins.size() / 3);
  std::string matrix, hits;
  const std::vector<Contestant> contestants = {
      {"locus", [&](size_t) { matrix = answer(work, work.sight).matrix; }, segments, {}},
      {"any_rays", [&](size_t) { hits = answer(work, work.rays).hits; }, segments, {}}};
  const auto times = race(contestants, 1, options.rounds, thread_seconds);
  ResultsHash hash;
  size_t seen = 0, differing = 0;
  for (size_t i = 0; i < matrix.size(); ++i) {
    hash.add(static_cast<uint8_t>(matrix[i]));
    const auto blocked = std::count(hits.begin() + long(kSamples * i), hits.begin() + long(kSamples * (i + 1)), '\1');
    const auto expected = static_cast<char>(long(kSamples) - blocked);
    differing += matrix[i] != expected;
    seen += static_cast<size_t>(expected);
  }
  add_cells(contestants, times, cell_of(name, "ns/segment", hash), report);
  if (differing != 0)
    report.disagreements.push_back(
        absl::StrFormat("%s: %d of %d targets differ from rays of mode ANY", name, differing, matrix.size()));
  const double blocked = 1 - static_cast<double>(seen) / segments;
  const bool shares_eyes = !one.pairwise && one.targets >= 32;
  note_bar(report, blocked >= 0.5 && shares_eyes ? kBlockedBar : kOpenBar,
           absl::StrFormat(" (%.0f %% blocked)", 100 * blocked));
}

}  // namespace

void run_sight_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  for (const SightCase& one : kCases) {
    const std::string name = absl::StrCat(one.name, "/", mesh.name);
    if (!options.filter.wants(name)) continue;
    progress(name);
    run_case(options, one, mesh, report);
  }
}

}  // namespace locus::bench::queries
