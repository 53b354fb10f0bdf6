#include "tests/bench/queries/object_cases.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/levels/generate/splitmix64.h"
#include "core/geometry/shape_distance.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/peer_library.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/queries/cell_cases.h"
#include "tests/bench/queries/query_run.h"
#include "tests/support/query_world.h"

namespace locus::bench::queries {
namespace {

using dynamic::Kind;
using dynamic::World;

constexpr uint32_t kObjects = 100'000, kQuickObjects = 3'000;
constexpr double kBulletBar = 4, kBallsBar = 2.5;
// Number of cells of free space around points near objects, and the distance at which the cells end.
constexpr size_t kCells = 1'000, kQuickCells = 50;
constexpr float kCellDistance = 50;

// Frustums of one case: each contains about the fraction `share` of the objects.
struct FrustumCase {
  const char* name;
  double share;
  size_t count;
  uint64_t seed;
};
constexpr FrustumCase kFrustumCases[] = {{"frustum/1", 0.01, 100, 511}, {"frustum/30", 0.3, 10, 512}};

// A world's objects in a scene of locus, and in a peer.
struct Arena {
  explicit Arena(const World& world) : objects(world.objects()) {
    test::QueryWorld content;
    for (size_t i = 0; i < objects.ids.size(); ++i)
      content.objects.push_back({objects.ids[i], 0, 0, kDefaultLayers, shape(i)});
    snapshot = test::snapshot_of(content);
#if LOCUS_BENCH_BULLET
    peer = bullet_objects(objects);
#endif
  }

  Shape shape(size_t i) const {
    Shape ball;
    ball.kind = ShapeKind::kBall;
    ball.position = to_double(dynamic::point_at(objects.positions, i));
    ball.radius = objects.radii[i];
    return ball;
  }

  dynamic::Objects objects;
  SnapshotPtr snapshot;
  std::unique_ptr<ObjectPeer> peer;  // null if Bullet is not installed
};

test::BlockResult answer(const SceneSnapshot& snapshot, QueryBlock block, bool brute_force = false) {
  block.source = Source::kDynamic;
  return answer_of(snapshot, std::move(block), brute_force);
}

// Finds the pairs by brute force and returns them sorted. Assigns the objects to cubes of space, and measures the
// distances of all objects in equal or adjacent cubes.
std::vector<ObjectPair> proved_pairs(const Arena& arena) {
  using Key = std::tuple<int, int, int>;
  std::map<Key, std::vector<size_t>> cubes;
  const float edge = kPairDistance + 2 * *std::max_element(arena.objects.radii.begin(), arena.objects.radii.end()) + 1;
  const auto key_of = [&](size_t i) {
    const Vec3f at = dynamic::point_at(arena.objects.positions, i);
    const auto index = [edge](float v) { return static_cast<int>(std::floor(v / edge)); };
    return Key(index(at.x), index(at.y), index(at.z));
  };
  for (size_t i = 0; i < arena.objects.ids.size(); ++i) cubes[key_of(i)].push_back(i);
  std::vector<ObjectPair> pairs;
  const auto measure = [&](size_t a, const std::vector<size_t>& others) {
    for (const size_t b : others) {
      const uint64_t low = arena.objects.ids[a], high = arena.objects.ids[b];
      if (low < high && distance_between(arena.shape(a), arena.shape(b)) <= double{kPairDistance})
        pairs.push_back({low, high});
    }
  };
  for (size_t i = 0; i < arena.objects.ids.size(); ++i) {
    const auto [x, y, z] = key_of(i);
    for (int n = 0; n < 27; ++n) {
      const auto found = cubes.find(Key(x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1));
      if (found != cubes.end()) measure(i, found->second);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

// Runs a ball query around each object, in as few batches as possible. The queries find each pair twice, and each query
// also finds its own object. Returns the number of rows.
size_t run_balls(const Arena& arena) {
  size_t rows = 0;
  std::vector<float> radii;
  for (const float radius : arena.objects.radii) radii.push_back(radius + kPairDistance);
  for (size_t begin = 0; begin < radii.size(); begin += limits::kMaxQueries) {
    const size_t count = std::min<size_t>(limits::kMaxQueries, radii.size() - begin);
    QueryBlock block;
    block.kind = BallColumns{arena.objects.positions.subspan(3 * begin, 3 * count),
                             absl::MakeConstSpan(radii).subspan(begin, count)};
    rows += answer(*arena.snapshot, block).ids.size();
  }
  return rows;
}

void run_pairs(const Options& options, const std::string& name, const Arena& arena, Report& report) {
  test::BlockResult ours;
  std::vector<ObjectPair> theirs;
  size_t ball_rows = 0;
  QueryBlock block;
  PairColumns columns;
  columns.max_distance = kPairDistance;
  block.kind = columns;
  block.max_results = limits::kMaxMaxResults;
  block.columns = {Column::kId, Column::kOther};
  std::vector<Contestant> contestants = {{"locus", [&](size_t) { ours = answer(*arena.snapshot, block); }, 1, {}},
                                         {"a ball each", [&](size_t) { ball_rows = run_balls(arena); }, 1, {}}};
  if (arena.peer != nullptr) {
    const auto run_theirs = [&](size_t) {
      theirs.clear();
      arena.peer->pairs(theirs);
    };
    contestants.push_back({"bullet", run_theirs, 1, {}});
  }
  const std::vector<ObjectPair> proved = proved_pairs(arena);
  for (Contestant& contestant : contestants)
    contestant.operations = static_cast<double>(std::max<size_t>(1, proved.size()));
  const auto times = race(contestants, 1, options.rounds, thread_seconds);
  ResultsHash hash;
  bool equal = ours.ids.size() == proved.size() && ours.others.size() == proved.size() && ours.truncated.empty();
  for (size_t i = 0; i < ours.ids.size(); ++i) {
    hash.add(ours.ids[i]);
    hash.add(ours.others[i]);
    equal = equal && proved[i] == ObjectPair{ours.ids[i], ours.others[i]};
  }
  add_cells(contestants, times, cell_of(name, "ns/pair", hash), report);
  if (!equal)
    report.disagreements.push_back(absl::StrFormat("%s: %d pairs, not the %d of a test of all near objects", name,
                                                   ours.ids.size(), proved.size()));
  if (arena.peer != nullptr) note_bar(report, kBulletBar);
  const Cell& balls = report.cells[report.cells.size() - contestants.size() + 1];
  report.notes.push_back(absl::StrFormat("%s beside %s: %.3f, required %.3f: %s", name, balls.peer_name, balls.ratio,
                                         kBallsBar, balls.ratio >= kBallsBar ? "shown" : "MISSED"));
  report.notes.push_back(
      absl::StrFormat("%s: %d pairs; bullet %d; %d rows of balls", name, proved.size(), theirs.size(), ball_rows));
}

// Camera that looks in a horizontal direction, with a field of view of 90 degrees horizontally and 60 vertically. Its
// planes are the near plane, four sides and the far plane.
struct Camera {
  Vec3f at, along;
  float planes[4 * kFrustumPlanes];

  Camera(Vec3f place, float angle) : at(place), along{std::cos(angle), std::sin(angle), 0} {
    const Vec3f right = {-along.y, along.x, 0}, up = {0, 0, 1};
    set(0, along, -1);
    const float wide = std::sqrt(0.5f), high = std::sqrt(3.0f) / 2;
    set(1, along * wide + right * wide, 0);
    set(2, along * wide - right * wide, 0);
    set(3, along * 0.5f + up * high, 0);
    set(4, along * 0.5f - up * high, 0);
    end_at(1e6f);
  }
  void end_at(float depth) { set(5, -along, depth); }
  bool holds(Vec3f point) const {
    for (size_t p = 0; p < kFrustumPlanes; ++p)
      if (dot(Vec3f{planes[4 * p], planes[4 * p + 1], planes[4 * p + 2]}, point) + planes[4 * p + 3] < 0) return false;
    return true;
  }

 private:
  // Sets plane number `plane`: a point p is inside it if dot(normal, p - at) >= -offset.
  void set(size_t plane, Vec3f normal, float offset) {
    const float numbers[4] = {normal.x, normal.y, normal.z, offset - dot(normal, at)};
    std::copy_n(numbers, 4, planes + 4 * plane);
  }
};

// Returns the planes of `count` frustums, at random points and in random directions. The far plane of each is placed so
// that the frustum contains the centres of about the fraction one.share of the objects.
std::vector<float> planes_of(const FrustumCase& one, const Arena& arena, size_t count) {
  cli::SplitMix64 numbers(one.seed);
  const auto unit = [&numbers] { return static_cast<float>(numbers.next() >> 40) * 0x1p-24f; };
  const auto wanted = static_cast<size_t>(one.share * static_cast<double>(arena.objects.ids.size()));
  std::vector<float> planes;
  while (planes.size() < 4 * kFrustumPlanes * count) {
    const Vec3f place = {dynamic::kSide * unit(), dynamic::kSide * unit(), 25 + 50 * unit()};
    Camera camera(place, 6.2831853f * unit());
    std::vector<float> depths;
    for (size_t i = 0; i < arena.objects.ids.size(); ++i) {
      const Vec3f at = dynamic::point_at(arena.objects.positions, i);
      if (camera.holds(at)) depths.push_back(dot(at - camera.at, camera.along));
    }
    if (depths.size() <= wanted) continue;
    std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(wanted), depths.end());
    camera.end_at(depths[wanted]);
    planes.insert(planes.end(), std::begin(camera.planes), std::end(camera.planes));
  }
  return planes;
}

void run_frustums(const Options& options, const FrustumCase& one, const std::string& name, const Arena& arena,
                  Report& report) {
  const size_t count = options.quick ? 3 : one.count;
  const std::vector<float> planes = planes_of(one, arena, count);
  test::BlockResult ours;
  std::vector<uint64_t> theirs;
  QueryBlock block;
  FrustumColumns frustums;
  frustums.planes = planes;
  block.kind = frustums;
  block.max_results = limits::kMaxMaxResults;
  block.columns = {Column::kId};
  std::vector<Contestant> contestants = {
      {"locus", [&](size_t) { ours = answer(*arena.snapshot, block); }, static_cast<double>(count), {}}};
  if (arena.peer != nullptr) {
    const auto run_theirs = [&](size_t) {
      theirs.clear();
      for (size_t i = 0; i < count; ++i) arena.peer->frustum(&planes[4 * kFrustumPlanes * i], theirs);
    };
    contestants.push_back({"bullet", run_theirs, static_cast<double>(count), {}});
  }
  const auto times = race(contestants, 1, options.rounds, thread_seconds);
  ResultsHash hash;
  for (const uint64_t id : ours.ids) hash.add(id);
  add_cells(contestants, times, cell_of(name, "ns/frustum", hash), report);
  if (arena.peer != nullptr) note_bar(report, kBulletBar);
  const test::BlockResult list = answer(*arena.snapshot, block, true);
  if (list.ids != ours.ids || list.counts != ours.counts || !ours.truncated.empty())
    report.disagreements.push_back(absl::StrCat(name, ": not the objects of a test of all objects"));
  report.notes.push_back(
      absl::StrFormat("%s: %d frustums hold %d objects; bullet %d", name, count, ours.ids.size(), theirs.size()));
}

}  // namespace

void run_object_cases(const Options& options, const Progress& progress, Report& report) {
  for (const Kind kind : {Kind::kUniform, Kind::kClustered}) {
    const World world(kind, options.quick ? kQuickObjects : kObjects);
    std::unique_ptr<Arena> arena;
    const auto wants = [&](const std::string& name) {
      if (!options.filter.wants(name)) return false;
      progress(name);
      if (arena == nullptr) arena = std::make_unique<Arena>(world);
      return true;
    };
    if (const std::string name = absl::StrCat("pairs/10/", world.name()); wants(name))
      run_pairs(options, name, *arena, report);
    for (const FrustumCase& one : kFrustumCases)
      if (const std::string name = absl::StrCat(one.name, "/", world.name()); wants(name))
        run_frustums(options, one, name, *arena, report);
    if (const std::string name = absl::StrCat("cell/32/", world.name()); wants(name)) {
      std::vector<float> points;
      for (const Vec3f point : dynamic::queries_of(world, options.quick ? kQuickCells : kCells).centers)
        points.insert(points.end(), {point.x, point.y, point.z});
      run_cells(options, name, {arena->snapshot, Source::kDynamic, points, kCellDistance}, report);
    }
  }
}

}  // namespace locus::bench::queries
