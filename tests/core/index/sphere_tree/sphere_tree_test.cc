#include "core/index/sphere_tree/sphere_tree.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/index/bvh/bvh.h"
#include "core/index/queries/index_queries.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/index_judge.h"

namespace locus::test {
namespace {

static_assert(SpatialIndex<SphereTree<Triangle>>);
static_assert(SpatialIndex<SphereTree<Object>>);

constexpr float kNoLimitf = std::numeric_limits<float>::infinity();

template <class V>
SphereTree<V> sphere_tree(std::vector<V> values) {
  absl::StatusOr<SphereTree<V>> tree = SphereTree<V>::build(std::move(values));
  EXPECT_TRUE(tree.ok()) << tree.status();
  return tree.ok() ? *std::move(tree) : SphereTree<V>();
}

std::vector<Object> uniform_balls(size_t count, uint64_t seed) {
  Random random(seed);
  std::vector<Object> balls;
  for (Id id = 1; id <= count; ++id) {
    Object ball;
    ball.id = id;
    ball.shape.kind = ShapeKind::kBall;
    ball.shape.radius = 0.25f;
    ball.shape.position = random.vector(std::cbrt(static_cast<double>(count)) / 2);
    balls.push_back(ball);
  }
  return balls;
}

TEST(SphereTreeTest, AnEmptyTreeAnswersNothing) {
  for (const SphereTree<Triangle>& tree : {SphereTree<Triangle>(), sphere_tree<Triangle>({})}) {
    EXPECT_EQ(tree.size(), 0u);
    EXPECT_EQ(tree.shape().nodes, 0u);
    EXPECT_FALSE(any_ray(tree, TriangleRay({0, 0, 0}, {1, 0, 0}), kNoLimitf));
    std::vector<Triangle> found;
    conservative_ball(tree, {{0, 0, 0}, 1e9f}, found);
    EXPECT_TRUE(found.empty());
  }
}

TEST(SphereTreeTest, BoundsThatAreNotFiniteAndWrongOptionsAreRefused) {
  std::vector<Triangle> triangles = bumpy_sphere(4, 0, 1);
  BvhOptions options;
  options.bins = 1;
  EXPECT_EQ(SphereTree<Triangle>::build(triangles, options).status().code(), absl::StatusCode::kInvalidArgument);
  triangles[5].b.y = kNoLimitf;
  EXPECT_EQ(SphereTree<Triangle>::build(triangles).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(SphereTreeTest, ACancelledBuildIsAnError) {
  const std::atomic<bool> cancel = true;
  BvhOptions options;
  options.cancel = &cancel;
  EXPECT_EQ(SphereTree<Triangle>::build(bumpy_sphere(40, 0, 1), options).status().code(), absl::StatusCode::kCancelled);
}

TEST(SphereTreeTest, EachValueIsInOneLeafAndTheTreeIsFlat) {
  const SphereTree<Object> tree = sphere_tree(uniform_balls(10'000, 1));
  EXPECT_EQ(tree.shape().references, 10'000u);
  EXPECT_LT(tree.shape().nodes, 20'000u);
  EXPECT_LT(tree.shape().depth, 24u);
}

TEST(SphereTreeTest, ManyEqualValuesStayWithinTheLimitOfDepth) {
  std::vector<Object> balls = uniform_balls(100'000, 1);
  for (Object& ball : balls) ball.shape.position = {1, 2, 3};
  const SphereTree<Object> tree = sphere_tree(balls);
  EXPECT_LE(tree.shape().depth, limits::kMaxBvhDepth);
  std::vector<Object> found;
  ball_overlap(tree, {{1, 2, 3}, 0}, found);
  EXPECT_EQ(found.size(), balls.size());
}

TEST(SphereTreeTest, HubAndCountryAndNeighboursOneUlpApartAreFoundAlike) {
  Random random(8);
  std::vector<Object> balls = uniform_balls(1'000, 2);
  for (size_t i = 0; i < balls.size(); ++i) {
    if (i % 10 == 0) balls[i].shape.position = random.vector(1e5);
    if (i % 10 == 1) {
      balls[i].shape.position = balls[i + 1].shape.position;
      balls[i].shape.position.x = std::nextafter(balls[i].shape.position.x, 1e9);
    }
  }
  const SphereTree<Object> tree = sphere_tree(balls);
  const ListIndex<Object> list = make_list(balls);
  const IndexJudge judge(tree, list);
  for (uint64_t i = 0; i < 100; ++i) {
    const Vec3d at = random.pick(balls).shape.position;
    ASSERT_EQ(judge.ray_difference(ObjectRay({at + random.vector(5), random.unit_vector()}), i), "");
    ASSERT_EQ(judge.ball_difference({at, random.between(0, 2)}), "");
    ASSERT_EQ(judge.point_difference(at + random.vector(2)), "");
  }
}

TEST(SphereTreeTest, AVisitEndsWhenTheVisitorHasEnough) {
  const SphereTree<Object> tree = sphere_tree(uniform_balls(1'000, 1));
  struct First {
    int visits = 0;
    double limit() const { return std::numeric_limits<double>::infinity(); }
    Aabbd bounds() const { return {{-99, -99, -99}, {99, 99, 99}}; }
    bool overlaps(const Aabbd&) const { return true; }
    bool visit(const Object&) { return ++visits % 3 != 0; }
  } first;
  Work work;
  tree.visit_region(first, work);
  tree.visit_nearest({}, first, work);
  EXPECT_EQ(first.visits, 6);
  EXPECT_EQ(work.tests, 6u);
}

// Measures work instead of time. Balls are larger than boxes, so queries open more nodes and test more values; the
// ceilings are a little above the ratios of the current trees.
TEST(SphereTreeTest, TheWorkIsAFewTimesThatOfATreeOfBoxes) {
  const std::vector<Object> balls = uniform_balls(20'000, 1);
  const SphereTree<Object> spheres = sphere_tree(balls);
  const absl::StatusOr<Bvh<Object>> boxes = Bvh<Object>::build(balls);
  ASSERT_TRUE(boxes.ok());
  Random random(2);
  Work of_spheres, of_boxes;
  for (int i = 0; i < 500; ++i) {
    const ObjectRay ray({random.pick(balls).shape.position, random.unit_vector()});
    Object hit;
    double t = 1e9;
    first_ray(spheres, ray, hit, t, &of_spheres);
    t = 1e9;
    first_ray(*boxes, ray, hit, t, &of_boxes);
  }
  EXPECT_LT(static_cast<double>(of_spheres.tests), 4 * static_cast<double>(of_boxes.tests));
}

TEST(SphereTreeTest, TheWorkOfSmallQueriesHardlyGrows) {
  const auto work_of = [](size_t count) {
    const std::vector<Object> balls = uniform_balls(count, 7);
    const SphereTree<Object> tree = sphere_tree(balls);
    Work work;
    Random random(1);
    for (int i = 0; i < 500; ++i) {
      std::vector<Object> found;
      conservative_ball(tree, {random.pick(balls).shape.position, 0.5}, found, &work);
    }
    return static_cast<double>(work.nodes + work.cells + work.tests);
  };
  EXPECT_LE(std::log(work_of(64'000) / work_of(1'000)) / std::log(64), 0.20);
}

}  // namespace
}  // namespace locus::test
