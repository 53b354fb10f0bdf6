#include "tests/bench/queries/overlap_cases.h"

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/check.h"
#include "core/geometry/capsule.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/queries/query_run.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::queries {
namespace {

constexpr size_t kQueries = 20'000, kQuickQueries = 600, kQueriesAChunk = 1'000;
// Radius and half length of the capsules, and radius of the balls whose rows are counted, as parts of the diagonal.
constexpr float kCapsuleRadius = 0.005f, kCapsuleHalf = 0.01f, kBallRadius = 0.015f;

// Row of a capsule query: the index of the capsule and the triangle that it touches.
using CapsuleRow = std::pair<size_t, uint32_t>;

// Locus: the mesh as the only instance of a scene, queried by whole batches.
class OurOverlaps {
 public:
  OurOverlaps(const BenchMesh& mesh, size_t count) : mesh_(mesh), snapshot_(scene_of(mesh)) {
    const std::vector<RayQuery> directions = random_rays(mesh, count, 702, 1);
    const std::vector<Ballf> places = balls(mesh, count, 701, kBallRadius);
    for (size_t i = 0; i < count; ++i) {
      const Vec3f half_axis = directions[i].direction * (kCapsuleHalf * mesh.diagonal);
      append(places[i].center, centers_);
      append(places[i].center - half_axis, starts_);
      append(places[i].center + half_axis, ends_);
    }
  }

  // Appends the rows of the capsules `begin` to end - 1 to `rows`, found by a query of capsules.
  void find_directly(size_t begin, size_t end, std::vector<CapsuleRow>& rows) const {
    const float radius = kCapsuleRadius * mesh_.diagonal;
    CapsuleColumns columns;
    columns.starts = part(starts_, begin, end);
    columns.ends = part(ends_, begin, end);
    columns.radii = {&radius, 1};
    columns.detail = StaticDetail::kTriangles;
    for_each_row(run(columns), begin, [&](size_t i, uint32_t triangle) { rows.emplace_back(i, triangle); });
  }

  // Appends the same rows as find_directly(), but queries balls around the capsules and tests each triangle of the
  // answer.
  void find_in_two_passes(size_t begin, size_t end, std::vector<CapsuleRow>& rows) const {
    // Slightly more than the sum of radius and half length, so that rounding of the sum cannot lose a triangle.
    const float radius = (kCapsuleRadius + kCapsuleHalf) * mesh_.diagonal * (1 + 0x1p-18f);
    BallColumns columns;
    columns.centers = part(centers_, begin, end);
    columns.radii = {&radius, 1};
    columns.detail = StaticDetail::kTriangles;
    for_each_row(run(columns), begin, [&](size_t i, uint32_t triangle) {
      if (capsule_overlaps(capsule(i), mesh_.triangles[triangle])) rows.emplace_back(i, triangle);
    });
  }

  // Returns the number of overlaps of the balls `begin` to end - 1. If `count_only` is true, the query returns no rows.
  uint64_t count(size_t begin, size_t end, bool count_only) const {
    const float radius = kBallRadius * mesh_.diagonal;
    BallColumns columns;
    columns.centers = part(centers_, begin, end);
    columns.radii = {&radius, 1};
    columns.detail = StaticDetail::kTriangles;
    const test::BlockResult result = run(columns, count_only);
    uint64_t sum = 0;
    for (const uint32_t count : result.counts) sum += count;
    LOCUS_CHECK_EQ(result.ids.size(), count_only ? 0 : sum);
    return sum;
  }

 private:
  static void append(Vec3f point, std::vector<float>& points) {
    points.insert(points.end(), {point.x, point.y, point.z});
  }
  static absl::Span<const float> part(const std::vector<float>& points, size_t begin, size_t end) {
    return absl::MakeConstSpan(points).subspan(3 * begin, 3 * (end - begin));
  }
  template <class Columns>
  test::BlockResult run(const Columns& columns, bool count_only = false) const {
    QueryBlock block;
    block.kind = columns;
    block.max_results = limits::kMaxMaxResults;
    block.count_only = count_only;
    test::BlockResult result = answer_of(*snapshot_, std::move(block));
    LOCUS_CHECK(result.truncated.empty());
    return result;
  }
  template <class Use>
  static void for_each_row(const test::BlockResult& result, size_t begin, const Use& use) {
    size_t row = 0;
    for (size_t i = 0; i < result.counts.size(); ++i)
      for (const size_t end = row + result.counts[i]; row < end; ++row) use(begin + i, result.triangles[row]);
  }
  // Returns the capsule with the midpoint and half axis that the engine computes from both ends.
  Capsule capsule(size_t i) const {
    const Vec3d start = read_vec3d(&starts_[3 * i]), end = read_vec3d(&ends_[3 * i]);
    return {(start + end) * 0.5, (end - start) * 0.5, double{kCapsuleRadius * mesh_.diagonal}};
  }

  const BenchMesh& mesh_;
  const SnapshotPtr snapshot_;
  std::vector<float> centers_, starts_, ends_;
};

void run_capsule_case(const Options& options, const std::string& name, size_t count, const OurOverlaps& ours,
                      Report& report) {
  std::vector<CapsuleRow> direct, two_passes;
  const size_t chunks = count / std::min(count, kQueriesAChunk), a_chunk = count / chunks;
  const auto operations = static_cast<double>(chunks * a_chunk);
  const auto run = [&](auto find, std::vector<CapsuleRow>& rows) {
    return [&ours, &rows, a_chunk, find](size_t chunk) {
      if (chunk == 0) rows.clear();
      (ours.*find)(chunk * a_chunk, (chunk + 1) * a_chunk, rows);
    };
  };
  const std::vector<Contestant> contestants = {
      {"locus", run(&OurOverlaps::find_directly, direct), operations, {}},
      {"two passes", run(&OurOverlaps::find_in_two_passes, two_passes), operations, {}}};
  const auto times = race(contestants, chunks, options.rounds, thread_seconds);
  ResultsHash hash;
  for (const auto& [capsule, triangle] : direct) {
    hash.add(capsule);
    hash.add(triangle);
  }
  add_cells(contestants, times, cell_of(name, "ns/capsule", hash), report);
  if (direct != two_passes)
    report.disagreements.push_back(absl::StrFormat("%s: %d rows of capsules, %d of balls and a test of their triangles",
                                                   name, direct.size(), two_passes.size()));
  report.notes.push_back(absl::StrFormat("%s: %d rows of %d capsules", name, direct.size(), chunks * a_chunk));
}

void run_count_case(const Options& options, const std::string& name, size_t count, const OurOverlaps& ours,
                    Report& report) {
  const size_t chunks = count / std::min(count, kQueriesAChunk), a_chunk = count / chunks;
  std::vector<uint64_t> counted(chunks), rows(chunks);
  const auto run = [&](bool count_only, std::vector<uint64_t>& sums) {
    return [&ours, &sums, a_chunk, count_only](size_t chunk) {
      sums[chunk] = ours.count(chunk * a_chunk, (chunk + 1) * a_chunk, count_only);
    };
  };
  const auto operations = static_cast<double>(chunks * a_chunk);
  const std::vector<Contestant> contestants = {{"locus", run(true, counted), operations, {}},
                                               {"rows", run(false, rows), operations, {}}};
  const auto times = race(contestants, chunks, options.rounds, thread_seconds);
  ResultsHash hash;
  uint64_t sum = 0;
  for (const uint64_t part : counted) {
    hash.add(part);
    sum += part;
  }
  add_cells(contestants, times, cell_of(name, "ns/ball", hash), report);
  if (counted != rows) report.disagreements.push_back(absl::StrCat(name, ": counts differ from the numbers of rows"));
  report.notes.push_back(absl::StrFormat("%s: %d overlaps of %d balls", name, sum, chunks * a_chunk));
}

}  // namespace

void run_overlap_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report) {
  const size_t count = options.quick ? kQuickQueries : kQueries;
  std::unique_ptr<OurOverlaps> ours;
  const auto wanted = [&](const std::string& name) {
    if (!options.filter.wants(name)) return false;
    progress(name);
    if (ours == nullptr) ours = std::make_unique<OurOverlaps>(mesh, count);
    return true;
  };
  if (const std::string name = absl::StrCat("capsule/direct/", mesh.name); wanted(name))
    run_capsule_case(options, name, count, *ours, report);
  if (const std::string name = absl::StrCat("count/balls/", mesh.name); wanted(name))
    run_count_case(options, name, count, *ours, report);
}

}  // namespace locus::bench::queries
