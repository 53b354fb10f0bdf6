// Proves the answers of capsules, contacts, nearest, frustums, sight, pairs and cells: the rows and distances of
// queries are compared with distances in long double. A difference is a fault if it is larger than an allowance e for
// rounding, 2^-20 of the coordinates and sizes. Each run tests some thousand queries of each kind; the long run tests a
// million of each kind, or the number in LOCUS_PROOF_QUERIES. Proofs of their own cover rays, sweeps and contains.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <ostream>
#include <set>
#include <utility>

#include "tests/support/proof/proof_tally.h"
#include "tests/support/proof/real_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr uint64_t kKindsSeed = 4711;
constexpr uint64_t kQueriesOfAWorld = 100;
constexpr size_t kObjectsOfPairs = 20;
constexpr size_t kEyes = 10;  // number of viewers and of targets of a world

void push(std::vector<float>& column, Vec3f v) { column.insert(column.end(), {v.x, v.y, v.z}); }

// Function that makes an answer wrong, for the test that the proofs notice wrong answers; empty in proofs.
using Spoil = std::function<void(BlockResult&)>;

BlockResult answer(const RealWorld& world, const OwnedBlock& block, const Spoil& spoil) {
  BlockResult result = run_block(world.snapshot(), block);
  if (spoil) spoil(result);
  return result;
}

// Notes a fault of query `query` of a world.
void note(ProofTally& tally, const RealWorld& world, const char* what, uint64_t query, Real value = 0) {
  tally.note(std::string(what) + ", seed " + std::to_string(world.seed()) + ", query " + std::to_string(query) + ": " +
             std::to_string(static_cast<double>(value)));
}

// Key of a row: id and triangle.
using RowKey = std::pair<Id, uint32_t>;

// Compares the rows of one query with the reference's distances of all primitives, which may be negative. Notes a fault
// if a primitive nearer than `limit` by more than `e` has no row, if a primitive farther by more than `e` has one, if
// the t of a row differs from the distance by more than `e`, or if a row is of no primitive or occurs twice.
class RowJudge {
 public:
  // The rows of `result` begin at `begin`.
  RowJudge(const RealWorld& world, const BlockResult& result, size_t begin, uint64_t query, ProofTally& tally)
      : world_(world), query_(query), tally_(tally) {
    for (size_t row = begin; row < begin + result.counts[query]; ++row)
      if (!rows_.emplace(RowKey{result.ids[row], result.triangles[row]}, result.t[row]).second) fault("a row twice");
  }

  void expect(RowKey key, Real distance, Real limit, Real e) {
    const auto row = rows_.find(key);
    if (row == rows_.end()) {
      if (distance < limit - e) fault("a miss", distance);
      return;
    }
    ++tally_.found;
    if (distance > limit + e) fault("a row of nothing", distance);
    if (!(std::fabs(Real{row->second} - distance) <= e)) fault("a wrong distance", distance);
    rows_.erase(row);
  }
  // Call this after expect() was called for all primitives.
  void finish() {
    if (!rows_.empty()) fault("a row of no primitive");
  }

 private:
  void fault(const char* what, Real value = 0) { note(tally_, world_, what, query_, value); }

  const RealWorld& world_;
  const uint64_t query_;
  ProofTally& tally_;
  std::map<RowKey, float> rows_;
};

// Capsules and balls as overlaps, with contacts: t is the distance from the inner segment to the primitive, and
// negative inside an object.
void prove_contacts(uint64_t seed, const Spoil& spoil, ProofTally& tally) {
  RealWorld world(seed);
  Random& random = world.random();
  const bool balls = random.chance(0.3);
  OwnedBlock block;
  block.settings.frame = world.frame();
  block.settings.columns = {Column::kT, Column::kId, Column::kTriangle};
  block.settings.max_results = 10'000;
  if (balls)
    block.settings.kind = BallColumns{{}, {}, StaticDetail::kTriangles};
  else
    block.settings.kind = CapsuleColumns{{}, {}, {}, StaticDetail::kTriangles};
  for (uint64_t i = 0; i < kQueriesOfAWorld; ++i) {
    const Vec3f start = world.point_near_a_triangle();
    const float radius = static_cast<float>(world.scale() * random.magnitude(-8, 0));
    push(block.points, start);
    if (balls) {
      block.sizes.push_back(radius);
      continue;
    }
    push(block.sizes, start + to_float(random.vector(world.scale() * random.magnitude(-6, 1))));
    block.extras.push_back(radius);
  }
  const BlockResult result = answer(world, block, spoil);
  size_t begin = 0;
  for (uint64_t i = 0; i < kQueriesOfAWorld; begin += result.counts[i++]) {
    ++tally.queries;
    const Vec3r start = world.real_point(&block.points[3 * i]);
    const Vec3r end = balls ? start : world.real_point(&block.sizes[3 * i]);
    RealSolid solid{kNoId, ShapeKind::kCapsule, (start + end) * 0.5L, (end - start) * 0.5L, 0};
    const Real radius = balls ? block.sizes[i] : block.extras[i];
    const Real e = world.allowance(solid.center, solid.size() + radius);
    RowJudge judge(world, result, begin, i, tally);
    for (uint32_t triangle = 0; triangle < world.triangles().size(); ++triangle)
      judge.expect({1, triangle}, world.distance_to_segment(triangle, solid), radius, e);
    for (const RealSolid& other : world.solids())
      judge.expect({other.id, kNoTriangle}, gap_between(solid, other), radius, e);
    judge.finish();
  }
}

// Nearest: the distances of the rows are the least distances.
void prove_nearest(uint64_t seed, const Spoil& spoil, ProofTally& tally) {
  constexpr uint32_t kRows = 5;
  RealWorld world(seed);
  OwnedBlock block;
  block.settings.frame = world.frame();
  block.settings.columns = {Column::kT, Column::kId, Column::kTriangle};
  block.settings.kind = NearestColumns{{}, {}, kRows, StaticDetail::kTriangles};
  for (uint64_t i = 0; i < kQueriesOfAWorld; ++i) push(block.points, world.point_near_a_triangle());
  const BlockResult result = answer(world, block, spoil);
  for (uint64_t i = 0; i < kQueriesOfAWorld; ++i) {
    ++tally.queries;
    const RealSolid point{kNoId, ShapeKind::kPoint, world.real_point(&block.points[3 * i]), {}, 0};
    const Real e = world.allowance(point.center, 0);
    std::map<RowKey, Real> distances;
    for (uint32_t triangle = 0; triangle < world.triangles().size(); ++triangle)
      distances[{1, triangle}] = world.distance_to_segment(triangle, point);
    for (const RealSolid& other : world.solids())
      distances[{other.id, kNoTriangle}] = std::max<Real>(0, gap_between(point, other));
    std::vector<Real> sorted;
    for (const auto& [key, distance] : distances) sorted.push_back(distance);
    std::sort(sorted.begin(), sorted.end());
    if (result.counts[i] != kRows) note(tally, world, "too few rows", i);
    for (size_t k = 0; k < std::min<size_t>(kRows, result.counts[i]); ++k) {
      const size_t row = i * kRows + k;
      ++tally.found;
      const auto own = distances.find({result.ids[row], result.triangles[row]});
      if (own == distances.end() || std::fabs(Real{result.t[row]} - own->second) > e)
        note(tally, world, "a wrong distance", i, result.t[row]);
      if (std::fabs(Real{result.t[row]} - sorted[k]) > e) note(tally, world, "a nearer primitive", i, sorted[k]);
    }
  }
}

struct RealPlane {
  Vec3r normal;  // unit vector
  Real offset;
};

// Returns the part of the polygon that lies within all planes, each moved outwards by `by`; empty if there is none.
std::vector<Vec3r> clipped(std::vector<Vec3r> polygon, const std::vector<RealPlane>& planes, Real by) {
  for (const RealPlane& plane : planes) {
    std::vector<Vec3r> kept;
    const auto height = [&](Vec3r p) { return dot(plane.normal, p) + plane.offset + by; };
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Vec3r a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      const Real at_a = height(a), at_b = height(b);
      if (at_a >= 0) kept.push_back(a);
      if ((at_a >= 0) != (at_b >= 0)) kept.push_back(a + (b - a) * (at_a / (at_a - at_b)));
    }
    polygon = std::move(kept);
    if (polygon.empty()) break;
  }
  return polygon;
}

// Returns the distance of a point from a convex polygon, given by its corners in order.
Real polygon_distance(Vec3r point, const std::vector<Vec3r>& polygon) {
  Real least = RealTriangle(polygon.front(), polygon.front(), polygon.back()).distance(point);
  for (size_t i = 2; i < polygon.size(); ++i)
    least = std::min(least, RealTriangle(polygon[0], polygon[i - 1], polygon[i]).distance(point));
  return least;
}

// Frustums. The allowance moves the planes. Triangles and points are clipped; other solids must be found if an end of
// their segment lies within all planes, and must not be found if they lie wholly outside of one plane.
void prove_frustums(uint64_t seed, const Spoil& spoil, ProofTally& tally) {
  constexpr size_t kPlanes = 6;
  RealWorld world(seed);
  Random& random = world.random();
  OwnedBlock block;
  block.settings.frame = world.frame();
  block.settings.columns = {Column::kId, Column::kTriangle};
  block.settings.max_results = 10'000;
  block.settings.kind = FrustumColumns{{}, {}, kPlanes, ClipDepth::kZeroToOne, StaticDetail::kTriangles};
  for (uint64_t i = 0; i < kQueriesOfAWorld; ++i) {
    const Vec3f inside = world.point_near_a_triangle();
    const double size = world.scale() * random.magnitude(-5, 2);
    for (size_t plane = 0; plane < kPlanes; ++plane) {
      const Vec3f normal = to_float(random.unit_vector());
      push(block.points, normal);
      block.points.push_back(
          static_cast<float>(size * random.between(0.2, 1) - dot(to_double(normal), to_double(inside))));
    }
  }
  const BlockResult result = answer(world, block, spoil);
  size_t row = 0;
  for (uint64_t i = 0; i < kQueriesOfAWorld; ++i) {
    ++tally.queries;
    std::vector<RealPlane> planes;
    Real size = 0;
    for (size_t plane = 0; plane < kPlanes; ++plane) {
      const float* const p = &block.points[4 * (i * kPlanes + plane)];
      const Vec3r normal = {p[0], p[1], p[2]};
      const Real factor = 1 / length(normal);
      const RealPlane real = {normal * factor, Real{p[3]} * factor};
      size = std::max(size, std::fabs(real.offset));
      planes.push_back({real.normal, real.offset - dot(real.normal, to_real(world.frame()))});
    }
    std::set<RowKey> rows;
    for (size_t end = row + result.counts[i]; row < end; ++row)
      if (!rows.insert({result.ids[row], result.triangles[row]}).second) note(tally, world, "a row twice", i);
    const Real e = world.allowance(to_real(world.frame()), size);
    const auto expect = [&](RowKey key, bool must, bool may) {
      const bool found = rows.erase(key) != 0;
      tally.found += found ? 1 : 0;
      if (!found && must) note(tally, world, "a miss", i);
      if (found && !may) note(tally, world, "a row of nothing", i);
    };
    for (uint32_t triangle = 0; triangle < world.corners().size(); ++triangle) {
      const std::vector<Vec3r> corners(world.corners()[triangle].begin(), world.corners()[triangle].end());
      expect({1, triangle}, !clipped(corners, planes, -e).empty(), !clipped(corners, planes, e).empty());
    }
    for (const RealSolid& solid : world.solids()) {
      const Vec3r ends[] = {solid.center - solid.half_axis, solid.center + solid.half_axis};
      bool must = false, may = true;
      for (const Vec3r& end : ends) must = must || !clipped({end}, planes, -e).empty();
      for (const RealPlane& plane : planes)
        may =
            may && std::max(dot(plane.normal, ends[0]), dot(plane.normal, ends[1])) + plane.offset + solid.radius > -e;
      expect({solid.id, kNoTriangle}, must, may);
    }
    if (!rows.empty()) note(tally, world, "a row of no primitive", i);
  }
}

// Returns whether a segment crosses the triangle, at least `e` inside the triangle's edges and away from its ends.
bool is_crossed(const RealCorners& corners, Vec3r from, Vec3r way, Real e) {
  const std::optional<Meeting> meeting = RealTriangle(corners[0], corners[1], corners[2]).meet({from, way}, 1);
  if (!meeting || meeting->inset < e) return false;
  const Real distance = meeting->t * std::fabs(meeting->slope);
  return distance >= e && (1 - meeting->t) * std::fabs(meeting->slope) >= e;
}

// Sight: a sample is not seen if a triangle or an object clearly blocks the segment to it, and is seen if nothing is
// near the segment.
void prove_sight(uint64_t seed, const Spoil& spoil, ProofTally& tally) {
  RealWorld world(seed, 10);
  OwnedBlock block;
  block.settings.frame = world.frame();
  block.settings.kind = SightColumns{};
  for (size_t i = 0; i < kEyes; ++i) push(block.points, world.point_near_a_triangle());
  for (size_t i = 0; i < kEyes; ++i) push(block.sizes, world.point_near_a_triangle());
  const BlockResult result = answer(world, block, spoil);
  for (size_t i = 0; i < kEyes * kEyes; ++i) {
    ++tally.queries;
    const Vec3r from = world.real_point(&block.points[i / kEyes * 3]),
                to = world.real_point(&block.sizes[i % kEyes * 3]);
    const RealSolid segment{kNoId, ShapeKind::kCapsule, (from + to) * 0.5L, (to - from) * 0.5L, 0};
    const Real e = world.allowance(segment.center, segment.size());
    const bool seen = result.matrix[i] != 0;
    tally.found += seen ? 0 : 1;
    Real nearest = std::numeric_limits<Real>::infinity();
    bool blocked = false;
    for (size_t triangle = 0; triangle < world.triangles().size(); ++triangle) {
      nearest = std::min(nearest, world.distance_to_segment(triangle, segment));
      blocked = blocked || is_crossed(world.corners()[triangle], from, to - from, e);
    }
    for (const RealSolid& other : world.solids()) {
      if (other.kind == ShapeKind::kPoint) continue;
      nearest = std::min(nearest, gap_between(segment, other));
      blocked = blocked || gap_between(segment, other) < -e;
    }
    if (seen && blocked) note(tally, world, "seen through a blocker", i);
    if (!seen && nearest > e) note(tally, world, "blocked by nothing", i, nearest);
  }
}

// Pairs: every two objects within the distance, once. Counts each pair of objects as a query.
void prove_pairs(uint64_t seed, const Spoil& spoil, ProofTally& tally) {
  RealWorld world(seed, kObjectsOfPairs);
  OwnedBlock block;
  PairColumns pairs;
  pairs.max_distance = static_cast<float>(world.scale() * world.random().magnitude(-2, 3));
  block.settings.kind = pairs;
  block.settings.columns = {Column::kT, Column::kId, Column::kOther};
  block.settings.max_results = 100'000;
  const BlockResult result = answer(world, block, spoil);
  std::map<std::pair<Id, Id>, float> rows;
  for (size_t row = 0; row < result.ids.size(); ++row)
    if (!rows.emplace(std::pair(result.ids[row], result.others[row]), result.t[row]).second)
      note(tally, world, "a pair twice", row);
  for (const RealSolid& a : world.solids())
    for (const RealSolid& b : world.solids()) {
      if (a.id >= b.id) continue;
      ++tally.queries;
      const Real gap = std::max<Real>(0, gap_between(a, b)), limit = pairs.max_distance;
      const Real e = world.allowance(a.center, a.size() + b.size());
      const auto row = rows.find({a.id, b.id});
      if (row == rows.end()) {
        if (gap < limit - e) note(tally, world, "a miss", a.id, gap);
        continue;
      }
      ++tally.found;
      if (gap > limit + e || std::fabs(Real{row->second} - gap) > e) note(tally, world, "a wrong pair", a.id, gap);
    }
}

// Cells: nothing reaches into the cell, and each plane is as far away as its primitive. Solids are tested at their
// nearest point and at points on their segments.
void prove_cells(uint64_t seed, const Spoil& spoil, ProofTally& tally) {
  RealWorld world(seed);
  OwnedBlock block;
  block.settings.frame = world.frame();
  block.settings.columns = {Column::kT, Column::kId, Column::kTriangle, Column::kPoint, Column::kNormal};
  block.settings.kind = CellColumns{};
  for (uint64_t i = 0; i < kQueriesOfAWorld; ++i) push(block.points, world.point_near_a_triangle());
  block.extras = {static_cast<float>(4 * world.scale())};
  const BlockResult result = answer(world, block, spoil);
  size_t row = 0;
  for (uint64_t i = 0; i < kQueriesOfAWorld; ++i) {
    ++tally.queries;
    const RealSolid point{kNoId, ShapeKind::kPoint, world.real_point(&block.points[3 * i]), {}, 0};
    const Real e = world.allowance(point.center, block.extras[0]);
    Real nearest = std::numeric_limits<Real>::infinity();
    for (size_t triangle = 0; triangle < world.triangles().size(); ++triangle)
      nearest = std::min(nearest, world.distance_to_segment(triangle, point));
    for (const RealSolid& other : world.solids()) nearest = std::min(nearest, gap_between(point, other));
    if (result.counts[i] == 0) {
      if (nearest > e) note(tally, world, "no cell in free space", i, nearest);
      continue;
    }
    if (nearest < -e) note(tally, world, "a cell inside of an object", i, nearest);
    const Real radius = result.t[row];
    std::vector<RealPlane> planes;
    for (size_t end = row++ + result.counts[i]; row < end; ++row) {
      ++tally.found;
      const float* const n = &result.normals[3 * row];
      const Vec3r normal = unit({n[0], n[1], n[2]}), at = world.real_point(&result.points[3 * row]);
      // A plane of the cell faces inwards here.
      planes.push_back({normal * -1, dot(normal, at)});
      const Id id = result.ids[row];
      if (id == 0 || id > 1 + world.solids().size() || (id == 1 && result.triangles[row] >= world.triangles().size())) {
        note(tally, world, "a plane of no primitive", i);
        continue;
      }
      const Real distance = id == 1 ? world.distance_to_segment(result.triangles[row], point)
                                    : gap_between(point, world.solids()[id - 2]);
      if (std::fabs(distance - Real{result.t[row]}) > e || std::fabs(length(at - point.center) - distance) > e)
        note(tally, world, "a plane that does not touch its primitive", i, distance);
    }
    const auto is_inside = [&](Vec3r p) {
      return length(p - point.center) < radius - e &&
             std::all_of(planes.begin(), planes.end(),
                         [&](const RealPlane& plane) { return dot(plane.normal, p) + plane.offset > e; });
    };
    for (const RealCorners& corners : world.corners()) {
      const std::vector<Vec3r> part = clipped({corners[0], corners[1], corners[2]}, planes, -e);
      if (!part.empty() && polygon_distance(point.center, part) < radius - e)
        note(tally, world, "a triangle in the cell", i);
    }
    for (const RealSolid& other : world.solids())
      for (int k = -4; k <= 4; ++k) {
        const Vec3r at = other.center + other.half_axis * (Real(k) / 4), away = point.center - at;
        if (length(away) > other.radius && is_inside(at + unit(away) * other.radius))
          note(tally, world, "an object in the cell", i);
      }
  }
}

constexpr Id kUnusedId = 9999;

void report_other_ids(BlockResult& result) { std::fill(result.ids.begin(), result.ids.end(), kUnusedId); }
void report_other_triangles(BlockResult& result) {
  for (uint32_t& triangle : result.triangles)
    if (triangle != kNoTriangle) triangle ^= 1;
}
void report_other_distances(BlockResult& result) {
  for (float& t : result.t) t *= 1.01f;
}
void turn_normals(BlockResult& result) {
  for (float& coordinate : result.normals) coordinate = -coordinate;
}
void move_points(BlockResult& result) {
  for (float& coordinate : result.points) coordinate *= 1.01f;
}
void see_all(BlockResult& result) { std::fill(result.matrix.begin(), result.matrix.end(), 1); }
void see_nothing(BlockResult& result) { std::fill(result.matrix.begin(), result.matrix.end(), 0); }

struct Proof {
  const char* name;
  void (*prove)(uint64_t seed, const Spoil& spoil, ProofTally& tally);
  uint64_t queries;  // number of queries of one call of prove()
  double least;      // least expected number of findings a query
  std::vector<Spoil> spoils;
};

const std::vector<Proof> kProofs = {
    {"contacts",
     prove_contacts,
     kQueriesOfAWorld,
     0.5,
     {report_other_ids, report_other_triangles, report_other_distances}},
    {"nearest", prove_nearest, kQueriesOfAWorld, 4, {report_other_ids, report_other_distances}},
    {"frustums", prove_frustums, kQueriesOfAWorld, 0.5, {report_other_ids, report_other_triangles}},
    {"sight", prove_sight, kEyes* kEyes, 0.1, {see_all, see_nothing}},
    {"pairs", prove_pairs, kObjectsOfPairs*(kObjectsOfPairs - 1) / 2, 0.05, {report_other_ids, report_other_distances}},
    {"cells",
     prove_cells,
     kQueriesOfAWorld,
     0.5,
     {report_other_ids, report_other_distances, turn_normals, move_points}},
};

void PrintTo(const Proof& proof, std::ostream* out) { *out << proof.name; }

class KindsProofTest : public ::testing::TestWithParam<Proof> {
 protected:
  static void expect_no_fault(uint64_t queries) {
    const Proof& proof = GetParam();
    const ProofTally all = run_trials((queries + proof.queries - 1) / proof.queries,
                                      [&](uint64_t i, ProofTally& tally) { proof.prove(kKindsSeed + i, {}, tally); });
    std::printf("proof: %llu queries of %s, %llu findings compared: %llu faults; seed %llu\n",
                static_cast<unsigned long long>(all.queries), proof.name, static_cast<unsigned long long>(all.found),
                static_cast<unsigned long long>(all.faults), static_cast<unsigned long long>(kKindsSeed));
    EXPECT_EQ(all.faults, 0u) << all.first_fault;
    EXPECT_GE(all.queries, queries);
    EXPECT_GT(static_cast<double>(all.found), proof.least * static_cast<double>(all.queries))
        << "too few findings to prove anything";
  }
};

std::string name_of(const ::testing::TestParamInfo<Proof>& proof) { return proof.param.name; }

TEST_P(KindsProofTest, AnswersAgreeWithTheReference) { expect_no_fault(scaled_count(5'000)); }

TEST_P(KindsProofTest, AWrongAnswerIsAFault) {
  for (const Spoil& spoil : GetParam().spoils) {
    ProofTally tally;
    for (uint64_t seed = 0; seed < 10; ++seed) GetParam().prove(kKindsSeed + seed, spoil, tally);
    EXPECT_GE(tally.faults, 5u);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, KindsProofTest, ::testing::ValuesIn(kProofs), name_of);

using LongKindsProofTest = KindsProofTest;

TEST_P(LongKindsProofTest, AnswersAgreeWithTheReference) {
  const char* const text = std::getenv("LOCUS_PROOF_QUERIES");
  expect_no_fault(text == nullptr ? 1'000'000 : static_cast<uint64_t>(std::strtod(text, nullptr)));
}
INSTANTIATE_TEST_SUITE_P(Kinds, LongKindsProofTest, ::testing::ValuesIn(kProofs), name_of);

}  // namespace
}  // namespace locus::test
