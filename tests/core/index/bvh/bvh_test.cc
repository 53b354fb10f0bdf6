#include "core/index/bvh/bvh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/index/queries/index_queries.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/index_judge.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

static_assert(SpatialIndex<Bvh<Triangle>>);
static_assert(SpatialIndex<Bvh<Object>>);

// Traits by which triangles lie in a mirrored world.
struct MirroredTriangleTraits : PrimitiveTraits<Triangle> {
  static Aabbf bounds(const Triangle& triangle) {
    const Aabbf box = bounds_of(triangle);
    return {-box.max, -box.min};
  }
  static bool ball(const Triangle& triangle, const Ballf& ball) {
    return ball_overlaps({-ball.center, ball.radius}, triangle);
  }
};
static_assert(SpatialIndex<Bvh<Triangle, MirroredTriangleTraits>>);

constexpr float kInfinity = std::numeric_limits<float>::infinity();

Bvh<Triangle> build(std::vector<Triangle> triangles) {
  absl::StatusOr<Bvh<Triangle>> tree = Bvh<Triangle>::build(std::move(triangles));
  EXPECT_TRUE(tree.ok()) << tree.status();
  return tree.ok() ? *std::move(tree) : Bvh<Triangle>();
}

// Returns a triangle that a ray along the x axis hits at `x`, and whose box begins at `box_start`.
Triangle across_x_axis(float x, float box_start, uint32_t number) {
  const float slope = x - box_start;
  return {{x - slope, -1, -1}, {x - slope, 1, -1}, {x + slope, 0, 1}, number};
}

// Returns rows of eight triangles of across_x_axis() at x = 0, 10, 20 and so on. A triangle's number / 8 is the index
// of its row.
std::vector<Triangle> rows_across_x_axis(uint32_t rows) {
  std::vector<Triangle> triangles;
  for (uint32_t i = 0; i < 8 * rows; ++i) {
    const float x = static_cast<float>(i / 8 * 10);
    triangles.push_back(across_x_axis(x, x - 1, i));
  }
  return triangles;
}

// Visitor that records the numbers of triangles in the order of the visit.
struct Recorder {
  float end = kInfinity;
  size_t wanted = std::numeric_limits<size_t>::max();
  std::vector<uint32_t> numbers;

  float limit() const { return end; }
  Aabbf bounds() const { return {{-9, -9, -9}, {9, 9, 9}}; }
  bool overlaps(const Aabbf& box) const { return locus::overlaps(box, bounds()); }
  bool visit(const Triangle& triangle) {
    numbers.push_back(triangle.number);
    return numbers.size() < wanted;
  }
};

std::vector<TriangleRay> incoherent_rays(const Aabbf& bounds, size_t count, uint64_t seed) {
  Random random(seed);
  std::vector<TriangleRay> rays;
  for (size_t i = 0; i < count; ++i) {
    Vec3d origin;
    for (int axis = 0; axis < 3; ++axis) origin[axis] = random.between(bounds.min[axis], bounds.max[axis]);
    rays.emplace_back(origin, random.unit_vector());
  }
  return rays;
}

// Mean work per ray of a search for the first hits of incoherent rays that start within the tree's bounds.
struct MeanWork {
  double nodes, tests;
};
MeanWork mean_work(const Bvh<Triangle>& tree) {
  const std::vector<TriangleRay> rays = incoherent_rays(tree.bounds(), 2'000, 17);
  Work work;
  for (const TriangleRay& ray : rays) {
    Triangle hit;
    float t = kInfinity;
    first_ray(tree, ray, hit, t, &work);
  }
  const double count = static_cast<double>(rays.size());
  return {static_cast<double>(work.nodes) / count, static_cast<double>(work.tests) / count};
}

TEST(BvhTest, AnEmptyTreeAnswersNothing) {
  const Bvh<Triangle> tree = build({});
  EXPECT_EQ(tree.size(), 0u);
  EXPECT_EQ(tree.node_count(), 0u);
  EXPECT_EQ(tree.sah_cost(), 0);
  EXPECT_TRUE(tree.bounds().empty());
  EXPECT_FALSE(any_ray(tree, TriangleRay({0, 0, 0}, {1, 0, 0}), kInfinity));
  std::vector<Triangle> found;
  ball_overlap(tree, {{0, 0, 0}, 1e9f}, found);
  EXPECT_TRUE(found.empty());
}

TEST(BvhTest, ATreeMadeByDefaultIsEmpty) {
  const Bvh<Triangle> tree;
  EXPECT_EQ(tree.size(), 0u);
  EXPECT_FALSE(any_ray(tree, TriangleRay({0, 0, 0}, {1, 0, 0}), kInfinity));
}

TEST(BvhTest, KeepsEveryValueAndTheirBounds) {
  const std::vector<Triangle> triangles = box_city(5, 1);
  const Bvh<Triangle> tree = build(triangles);
  EXPECT_THAT(tree.values(), ::testing::UnorderedElementsAreArray(triangles));
  Aabbf bounds;
  for (const Triangle& triangle : triangles) bounds = merge(bounds, bounds_of(triangle));
  EXPECT_EQ(tree.bounds(), bounds);
  EXPECT_GE(tree.bytes(), triangles.size() * sizeof(Triangle));
}

TEST(BvhTest, TheStorageOrderIsTheSameForTheSameInput) {
  const Bvh<Triangle> a = build(box_city(5, 1)), b = build(box_city(5, 1));
  EXPECT_THAT(a.values(), ::testing::ElementsAreArray(b.values()));
}

TEST(BvhTest, RegionsAreVisitedInStorageOrder) {
  const Bvh<Triangle> tree = build(bumpy_sphere(12, 0.1, 4));
  Recorder recorder;
  Work work;
  tree.visit_region(recorder, work);
  std::vector<uint32_t> stored;
  for (const Triangle& triangle : tree.values()) stored.push_back(triangle.number);
  EXPECT_EQ(recorder.numbers, stored);
  EXPECT_EQ(work.tests, tree.size());
  EXPECT_EQ(work.nodes, tree.node_count());
}

// The boxes of two leaves can overlap. Then the leaf that the ray enters first may contain a farther hit than the leaf
// that the ray enters next (Hughes et al., ch. 37, Fig. 37.15). So the hit that is found first need not be the nearest.
TEST(BvhTest, AFartherHitInTheLeafVisitedFirstDoesNotHideANearerOneInALaterLeaf) {
  std::vector<Triangle> triangles;
  for (uint32_t i = 0; i < 8; ++i) triangles.push_back(across_x_axis(10, 1, i));
  for (uint32_t i = 8; i < 16; ++i) triangles.push_back(across_x_axis(5, 4.5f, i));
  const Bvh<Triangle> tree = build(triangles);
  const TriangleRay ray({0, 0, 0}, {1, 0, 0});
  Recorder recorder;
  Work work;
  tree.visit_ray(ray.slabs(), recorder, work);
  ASSERT_EQ(recorder.numbers.size(), 16u);
  ASSERT_LT(recorder.numbers.front(), 8u) << "the straddling triangles must be visited first";

  Triangle hit;
  float t = kInfinity;
  ASSERT_TRUE(first_ray(tree, ray, hit, t));
  EXPECT_EQ(hit.number, 8u);
  EXPECT_EQ(t, 5.0f);
}

TEST(BvhTest, RaysVisitLeavesNearToFar) {
  const Bvh<Triangle> tree = build(rows_across_x_axis(8));
  for (const double sign : {1.0, -1.0}) {
    Recorder recorder;
    Work work;
    tree.visit_ray(TriangleRay({sign > 0 ? -100.0 : 200.0, 0, 0}, {sign, 0, 0}).slabs(), recorder, work);
    ASSERT_EQ(recorder.numbers.size(), 64u);
    for (size_t i = 0; i < 64; ++i) EXPECT_EQ(recorder.numbers[i] / 8, sign > 0 ? i / 8 : 7 - i / 8);
  }
}

TEST(BvhTest, AFirstHitCullsTheLeavesBehindIt) {
  const Bvh<Triangle> tree = build(rows_across_x_axis(8));
  Triangle hit;
  float t = kInfinity;
  Work work;
  ASSERT_TRUE(first_ray(tree, TriangleRay({-5, 0, 0}, {1, 0, 0}), hit, t, &work));
  EXPECT_EQ(hit.number, 0u);
  EXPECT_EQ(work.tests, 8u);
}

TEST(BvhTest, BoxesBehindTheOriginOrBeyondTheLimitAreNotVisited) {
  const Bvh<Triangle> tree = build(rows_across_x_axis(3));
  Recorder recorder;
  recorder.end = 5;
  Work work;
  tree.visit_ray(TriangleRay({7, 0, 0}, {1, 0, 0}).slabs(), recorder, work);
  ASSERT_EQ(recorder.numbers.size(), 8u);
  for (const uint32_t number : recorder.numbers) EXPECT_EQ(number / 8, 1u);
}

TEST(BvhTest, AVisitEndsWhenTheVisitorHasEnough) {
  const Bvh<Triangle> tree = build(bumpy_sphere(8, 0, 1));
  Work work;
  Recorder on_ray, in_region;
  on_ray.wanted = in_region.wanted = 3;
  tree.visit_ray(TriangleRay({-5, 0, 0}, {1, 0, 0}).slabs(), on_ray, work);
  tree.visit_region(in_region, work);
  EXPECT_EQ(on_ray.numbers.size(), 3u);
  EXPECT_EQ(in_region.numbers.size(), 3u);
  EXPECT_EQ(work.tests, 6u);
}

TEST(BvhTest, RaysFromInsideAClosedMeshAlwaysHit) {
  const std::vector<Triangle> triangles = bumpy_sphere(24, 0.01, 9);
  const Bvh<Triangle> tree = build(triangles);
  Random random(5);
  for (const Triangle& triangle : triangles) {
    const Vec3d origin = random.vector(0.3);
    const Vec3d a = to_double(triangle.a), b = to_double(triangle.b);
    for (const Vec3d target : {a, (a + b) * 0.5, a + (b - a) * random.unit()}) {
      ASSERT_TRUE(any_ray(tree, TriangleRay(origin, target - origin), kInfinity)) << "triangle " << triangle.number;
    }
  }
}

TEST(BvhTest, LargeMeshesAnswerAsTheListDoes) {
  const std::vector<Triangle> triangles = box_city(12, 3);
  const Bvh<Triangle> tree = build(triangles);
  const auto list = make_list(triangles);
  const IndexJudge judge(tree, list);
  Random random(21);
  const auto lattice = [&] { return random.whole_vector(240) * 0.5; };
  for (uint64_t i = 0; i < scaled_count(2'000); ++i) {
    const Vec3d direction = random.chance(0.5) ? random.whole_vector(1) : random.unit_vector();
    if (direction == Vec3d{}) continue;
    ASSERT_EQ(judge.ray_difference(TriangleRay(abs(lattice()), direction), i), "") << "ray " << i;
    ASSERT_EQ(judge.ball_difference({to_float(abs(lattice())), static_cast<float>(random.whole(0, 20)) * 0.5f}), "")
        << "ball " << i;
  }
}

// Tests the cost, since a badly split tree still answers correctly. The ceilings are 5 % above the costs of the current
// builder.
TEST(BvhTest, SahCostAndVisitsOfASphereStayUnderTheirCeilings) {
  const Bvh<Triangle> tree = build(bumpy_sphere(64, 0.02, 1));
  const MeanWork work = mean_work(tree);
  EXPECT_LT(tree.sah_cost(), 11.4);
  EXPECT_LT(work.nodes, 5.3);
  EXPECT_LT(work.tests, 10.9);
}

TEST(BvhTest, SahCostAndVisitsOfACityStayUnderTheirCeilings) {
  const Bvh<Triangle> tree = build(box_city(32, 1));
  const MeanWork work = mean_work(tree);
  EXPECT_LT(tree.sah_cost(), 11.6);
  EXPECT_LT(work.nodes, 4.6);
  EXPECT_LT(work.tests, 8.6);
}

TEST(BvhTest, TheSecondArgumentReplacesTheTraitsOfTheValues) {
  const std::vector<Triangle> triangles = rows_across_x_axis(8);
  const auto tree = *Bvh<Triangle, MirroredTriangleTraits>::build(triangles);
  std::vector<Triangle> found;
  ball_overlap(tree, {{-20, 0, 0}, 1}, found);
  EXPECT_EQ(found.size(), 8u);
  for (const Triangle& triangle : found) EXPECT_EQ(triangle.number / 8, 2u);
  found.clear();
  ball_overlap(tree, {{20, 0, 0}, 1}, found);
  EXPECT_TRUE(found.empty());
}

TEST(BvhTest, ErrorsOfTheBuildArePassedOn) {
  std::vector<Triangle> triangles = bumpy_sphere(4, 0, 1);
  triangles[5].b.y = kInfinity;
  EXPECT_EQ(Bvh<Triangle>::build(triangles).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace locus::test
