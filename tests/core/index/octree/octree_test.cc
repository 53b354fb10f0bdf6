#include "core/index/octree/octree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/index/queries/nearest_values.h"
#include "tests/support/octree_comparison.h"

namespace locus::test {
namespace {

static_assert(MutableSpatialIndex<Octree<Triangle>>);
static_assert(MutableSpatialIndex<Octree<Object>>);

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr CutValues kBothPlaces[] = {CutValues::kInLeaves, CutValues::kAtNode};

Object cube_at(Vec3d center, double half, uint32_t id) { return value_filling<Object>(center, {half, half, half}, id); }

std::vector<Object> cubes_on_a_lattice(int side, double half) {
  std::vector<Object> cubes;
  for (int i = 0; i < side * side * side; ++i) {
    const Vec3d center = {double(i % side), double(i / side % side), double(i / (side * side))};
    cubes.push_back(cube_at(center, half, static_cast<uint32_t>(i + 1)));
  }
  return cubes;
}

std::vector<Id> octree_ids(const std::vector<Object>& objects) {
  std::vector<Id> ids;
  for (const Object& object : objects) ids.push_back(object.id);
  return ids;
}

TEST(OctreeTest, AnswersAsTheListOnRandomScenes) { EXPECT_EQ(search_octrees(scaled_count(300), 0), ""); }

TEST(OctreeTest, AnswersAsTheListOnAdversarialScenes) { EXPECT_EQ(search_octrees(0, scaled_count(150)), ""); }

TEST(OctreeTest, AnEmptyTreeAnswersNothing) {
  for (const CutValues cut : kBothPlaces) {
    const Octree<Object> tree(octree_options(7, cut));
    EXPECT_EQ(tree.size(), 0u);
    EXPECT_TRUE(tree.bounds().empty());
    EXPECT_FALSE(any_ray(tree, ObjectRay(Rayd{{0, 0, 0}, {1, 0, 0}}), kEndless));
    std::vector<Object> found;
    ball_overlap(tree, {{0, 0, 0}, 1e9}, found);
    EXPECT_TRUE(found.empty());
    std::vector<ValueAt<Object>> nearest;
    nearest_values(tree, {0, 0, 0}, kEndless, 3, nearest);
    EXPECT_TRUE(nearest.empty());
  }
}

TEST(OctreeTest, DividesOnlyTheChosenAxes) {
  OctreeOptions options;
  options.max_depth = 1;
  for (uint32_t axes = 1; axes < 8; ++axes) {
    options.axes = octree_options(axes, CutValues::kInLeaves).axes;
    const auto tree = Octree<Object>::build(cubes_on_a_lattice(4, 0.1), options);
    EXPECT_EQ(tree.shape().nodes, 1 + (1u << __builtin_popcount(axes))) << "axes " << axes;
    EXPECT_EQ(tree.shape().references, 64u);
    EXPECT_EQ(tree.shape().depth, 1u);
  }
}

TEST(OctreeTest, ValuesThatAPlaneCutsLieInAllPartsOrAtTheNode) {
  OctreeOptions options;
  options.max_depth = 1;
  std::vector<Object> cubes = cubes_on_a_lattice(4, 0.1);
  cubes.push_back(cube_at({1.5, 1.5, 1.5}, 0.1, 65));
  const auto in_leaves = Octree<Object>::build(cubes, options);
  EXPECT_EQ(in_leaves.shape().references, 64u + 8);
  options.cut = CutValues::kAtNode;
  const auto at_node = Octree<Object>::build(cubes, options);
  EXPECT_EQ(at_node.shape().references, 65u);
}

TEST(OctreeTest, AValueOnAPlaneIsFoundFromBothSides) {
  for (const CutValues cut : kBothPlaces) {
    std::vector<Object> points = {value_filling<Object>({-4, -4, -4}, {}, 1), value_filling<Object>({4, 4, 4}, {}, 2)};
    for (uint32_t id = 3; id < 30; ++id)
      points.push_back(
          value_filling<Object>(to_double(to_float(Vec3d{id % 3 - 1.0, id / 3 % 3 - 1.0, id / 9 - 2.0})), {}, id));
    const auto tree = Octree<Object>::build(points, octree_options(7, cut));
    ASSERT_GT(tree.shape().depth, 0u);
    for (const Object& point : points) {
      for (const Vec3d side : lattice_directions()) {
        std::vector<Object> found;
        const Vec3d half = abs(side) * 0.5;
        box_overlap(tree, {point.shape.position + side * 0.5, half, {}}, found);
        EXPECT_THAT(octree_ids(found), ::testing::Contains(point.id));
      }
    }
  }
}

TEST(OctreeTest, TwoValuesOneStepApartAreSeparated) {
  const double next = std::nextafter(1.0, 2.0);
  const std::vector<Object> points = {value_filling<Object>({1, 1, 1}, {}, 1),
                                      value_filling<Object>({next, 1, 1}, {}, 2)};
  for (const CutValues cut : kBothPlaces) {
    OctreeOptions options = octree_options(1, cut);
    options.leaf_size = 1;
    const auto tree = Octree<Object>::build(points, options);
    EXPECT_EQ(tree.shape().nodes, 3u);
    for (const Object& point : points) {
      std::vector<Object> found;
      ball_overlap(tree, {point.shape.position, 0}, found);
      EXPECT_THAT(octree_ids(found), ::testing::ElementsAre(point.id));
    }
  }
}

TEST(OctreeTest, AHundredThousandEqualValuesLieInOneLeaf) {
  for (const CutValues cut : kBothPlaces) {
    std::vector<Object> boxes;
    for (uint32_t i = 0; i < 100'000; ++i) boxes.push_back(cube_at({1, 2, 3}, 0.5, i + 1));
    const auto tree = Octree<Object>::build(boxes, octree_options(7, cut));
    EXPECT_EQ(tree.shape().nodes, 1u);
    EXPECT_EQ(tree.shape().references, boxes.size());
    Object first;
    double distance = kEndless;
    ASSERT_TRUE(first_ray(tree, ObjectRay(Rayd{{1, 2, -9}, {0, 0, 1}}), first, distance));
    EXPECT_EQ(first.id, 1u);
  }
}

TEST(OctreeTest, AHubInAWideCountryIsDividedAsWell) {
  Random random(7);
  TestScene<Object> scene;
  for (uint32_t i = 0; i < 2'000; ++i) {
    const bool far = i % 20 == 0;
    scene.values.push_back(cube_at(random.vector(far ? 1e6 : 1), far ? 100 : 0.01, i + 1));
  }
  SceneSketch sketch{"hub and country", {}, {}, {}, {}};
  for (const Object& object : scene.values) sketch.placements.push_back({object.shape.position, {}, {}});
  add_queries(sketch, 20, 0.1, random);
  add_queries(sketch, 10, 1e5, random);
  const std::vector<Object> values = std::move(scene.values);
  scene = make_scene<Object>(sketch, random);
  scene.values = values;
  for (const CutValues cut : kBothPlaces) EXPECT_EQ(octree_difference(scene, octree_options(7, cut)), "");
  const auto tree = Octree<Object>::build(values);
  Work work;
  std::vector<Object> found;
  ball_overlap(tree, {{0, 0, 0}, 0.02}, found, &work);
  EXPECT_LT(work.nodes, 100u);
  EXPECT_LT(work.tests, 50u);
}

TEST(OctreeTest, NodesAndReferencesAndDepthStayWithinTheirLimits) {
  Random random(3);
  for (const double size : {0.01, 0.5, 4.0}) {
    for (const CutValues cut : kBothPlaces) {
      std::vector<Object> boxes;
      for (uint32_t i = 0; i < 3'000; ++i) boxes.push_back(cube_at(random.vector(i % 2 == 0 ? 1 : 100), size, i + 1));
      OctreeOptions options = octree_options(7, cut);
      for (const uint32_t depth : {0u, 3u, 32u, limits::kMaxOctreeDepth}) {
        options.max_depth = depth;
        EXPECT_EQ(octree_shape_fault(Octree<Object>::build(boxes, options), depth), "");
      }
    }
  }
}

TEST(OctreeTest, ValuesFarOutsideTheFirstBoundsAreFound) {
  for (const CutValues cut : kBothPlaces) {
    auto tree = Octree<Object>::build(cubes_on_a_lattice(3, 0.1), octree_options(7, cut));
    tree.insert(cube_at({1e8, -1e7, 3}, 1, 100));
    std::vector<Object> found;
    ball_overlap(tree, {{1e8, -1e7, 3}, 1}, found);
    EXPECT_THAT(octree_ids(found), ::testing::ElementsAre(100u));
    EXPECT_TRUE(any_ray(tree, ObjectRay(Rayd{{1e8, -1e7, -1e6}, {0, 0, 1}}), kEndless));
    std::vector<ValueAt<Object>> nearest;
    nearest_values(tree, {2e8, 0, 0}, kEndless, 1, nearest);
    ASSERT_EQ(nearest.size(), 1u);
    EXPECT_EQ(nearest[0].value.id, 100u);
  }
}

TEST(OctreeTest, TenThousandRandomInsertsAndRemovesLeaveNoGhost) {
  for (const CutValues cut : kBothPlaces) {
    Random random(11);
    const TestScene<Object> queries = make_scene<Object>(random_scene(random), random);
    Octree<Object> tree = Octree<Object>::build(cubes_on_a_lattice(4, 0.3), octree_options(7, cut));
    for (const Object& cube : cubes_on_a_lattice(4, 0.3)) ASSERT_TRUE(tree.remove(cube));
    EXPECT_EQ(drift_difference(tree, scaled_count(10'000), queries, random), "");
    const size_t size = tree.size();
    tree.rebuild();
    EXPECT_EQ(tree.size(), size);
    EXPECT_EQ(octree_shape_fault(tree, limits::kMaxOctreeDepth), "");
  }
}

TEST(OctreeTest, ARebuiltTreeAnswersAsTheList) {
  std::vector<Object> cubes = cubes_on_a_lattice(4, 0.2);
  Octree<Object> tree(octree_options(7, CutValues::kInLeaves));
  ListIndex<Object> list;
  Random random(5);
  const TestScene<Object> queries = make_scene<Object>(walls_on_a_lattice(random), random);
  ASSERT_EQ(changed_difference(tree, list, cubes, queries), "");
  EXPECT_EQ(tree.shape().nodes, 1u);
  tree.rebuild();
  EXPECT_GT(tree.shape().nodes, 1u);
  EXPECT_EQ(IndexJudge(tree, list).difference(queries), "");
}

TEST(OctreeTest, AShortRayOpensOnlyTheNodesNearIt) { EXPECT_EQ(octree_short_ray_fault(), ""); }

TEST(OctreeTest, AFirstHitEndsTheVisitOfPartsBehindIt) {
  const auto tree = Octree<Object>::build(cubes_on_a_lattice(16, 0.1));
  for (const double x : {-50.0, 50.0}) {
    Object first;
    double distance = kEndless;
    Work work;
    ASSERT_TRUE(first_ray(tree, ObjectRay(Rayd{{x, 5, 5}, {-x, 0, 0}}), first, distance, &work));
    EXPECT_EQ(first.shape.position.x, x < 0 ? 0 : 15);
    EXPECT_LT(work.tests, 32u);
  }
}

// The sign of a component that is zero decides on which side of its planes the slab test begins.
TEST(OctreeTest, ComponentsOfMinusZeroLoseNoHit) {
  const auto tree = Octree<Object>::build(cubes_on_a_lattice(4, 0.4), octree_options(7, CutValues::kInLeaves));
  for (const double zero : {0.0, -0.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        for (int i = 0; i < 16; ++i) {
          Rayd ray{{double(i % 4), double(i / 4), double(i % 4)}, {zero, zero, zero}};
          ray.origin[axis] = -9 * sign;
          ray.direction[axis] = sign;
          EXPECT_TRUE(any_ray(tree, ObjectRay(ray), 20)) << "axis " << axis << ", " << i;
        }
      }
    }
  }
}

TEST(OctreeTest, AVisitEndsWhenTheVisitorHasEnough) {
  const auto tree = Octree<Object>::build(cubes_on_a_lattice(4, 0.6));
  Work work;
  EXPECT_TRUE(any_ray(tree, ObjectRay(Rayd{{-9, 1, 1}, {1, 0, 0}}), kEndless, &work));
  EXPECT_EQ(work.tests, 1u);
}

}  // namespace
}  // namespace locus::test
