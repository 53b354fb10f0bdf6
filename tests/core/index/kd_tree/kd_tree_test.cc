#include "core/index/kd_tree/kd_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/index/queries/index_queries.h"
#include "core/index/queries/nearest_values.h"
#include "tests/support/adversarial_scenes.h"
#include "tests/support/index_judge.h"
#include "tests/support/random.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

static_assert(MutableSpatialIndex<KdTree<Triangle>>);
static_assert(MutableSpatialIndex<KdTree<Object>>);

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

constexpr KdAxis kKdAxes[] = {KdAxis::kByTurns, KdAxis::kWidest};
constexpr KdSplit kKdSplits[] = {KdSplit::kMiddle, KdSplit::kMean, KdSplit::kMedian, KdSplit::kSah};

KdTreeOptions kd_options(KdSplit split, CutValues cut = CutValues::kInLeaves) {
  KdTreeOptions options;
  options.split = split;
  options.cut = cut;
  options.leaf_size = 1;
  return options;
}

std::vector<Id> found_ids(const std::vector<Object>& objects) {
  std::vector<Id> ids;
  for (const Object& object : objects) ids.push_back(object.id);
  return ids;
}

std::vector<Object> kd_boxes(uint32_t count, double size, uint64_t seed) {
  Random random(seed);
  std::vector<Object> objects;
  for (uint32_t i = 0; i < count; ++i)
    objects.push_back(box_object(i + 1, random.vector(100), to_float(random.positive_vector(size))));
  return objects;
}

// Points at x = 0, 1, 2, ... with ids 1, 2, 3, ...
std::vector<Object> kd_points_on_axis(uint32_t count) {
  std::vector<Object> objects;
  for (uint32_t i = 0; i < count; ++i) objects.push_back(point_object(i + 1, {double(i), 0, 0}));
  return objects;
}

// Visitor that accepts every value up to a limit and counts them.
struct KdCounter {
  double end = kUnlimited;
  size_t count = 0;

  double limit() const { return end; }
  bool visit(const Object&) {
    ++count;
    return true;
  }
};

TEST(KdTreeTest, AnEmptyTreeAnswersNothingAndTakesValues) {
  KdTree<Object> tree = KdTree<Object>::build({});
  EXPECT_EQ(tree.size(), 0u);
  EXPECT_EQ(tree.shape().nodes, 1u);
  EXPECT_FALSE(any_ray(tree, ObjectRay(Rayd{{0, 0, 0}, {1, 0, 0}}), kUnlimited));
  EXPECT_FALSE(tree.remove(ball_object(1, {0, 0, 0})));
  tree.insert(ball_object(1, {5, 0, 0}));
  EXPECT_TRUE(tree.contains(ball_object(1, {5, 0, 0})));
  EXPECT_TRUE(any_ray(tree, ObjectRay(Rayd{{0, 0, 0}, {1, 0, 0}}), kUnlimited));
}

TEST(KdTreeTest, NodesReferencesAndDepthKeepTheirLimitsForEveryRule) {
  for (const double size : {0.5, 20.0, 200.0})
    for (const KdAxis axis : kKdAxes)
      for (const KdSplit split : kKdSplits)
        for (const CutValues cut : {CutValues::kInLeaves, CutValues::kAtNode}) {
          KdTreeOptions options = kd_options(split, cut);
          options.axis = axis;
          options.max_depth = 12;
          const PlaneTreeShape shape = KdTree<Object>::build(kd_boxes(2'000, size, 3), options).shape();
          EXPECT_LT(shape.nodes, 4'000u) << size;
          EXPECT_LT(shape.references, 8'000u) << size;
          EXPECT_LE(shape.depth, 12u) << size;
          if (cut == CutValues::kAtNode) {
            EXPECT_EQ(shape.references, 2'000u);
          }
        }
}

TEST(KdTreeTest, MedianAndSahSeparatePointsOfAnyDensity) {
  std::vector<Object> points;
  for (uint32_t i = 0; i < 40; ++i) points.push_back(point_object(i + 1, {std::exp2(i), 0, 0}));
  EXPECT_EQ(KdTree<Object>::build(points, kd_options(KdSplit::kMedian)).shape().depth, 6u);
  EXPECT_EQ(KdTree<Object>::build(points, kd_options(KdSplit::kMedian)).shape().nodes, 79u);
  EXPECT_GT(KdTree<Object>::build(points, kd_options(KdSplit::kMiddle)).shape().depth, 20u);
}

TEST(KdTreeTest, AMedianThatIsAlsoTheHighestPositionStillSeparatesTheOthers) {
  std::vector<Object> points = {point_object(1, {0, 0, 0}), point_object(2, {1, 0, 0})};
  for (Id id = 3; id <= 10; ++id) points.push_back(point_object(id, {2, 0, 0}));
  EXPECT_EQ(KdTree<Object>::build(points, kd_options(KdSplit::kMedian)).shape().nodes, 5u);
}

TEST(KdTreeTest, EqualValuesStayInOneLeaf) {
  std::vector<Object> equal;
  for (Id id = 1; id <= 100; ++id) equal.push_back(box_object(id, {1, 2, 3}));
  for (const KdSplit split : kKdSplits) EXPECT_EQ(KdTree<Object>::build(equal, kd_options(split)).shape().nodes, 1u);
}

TEST(KdTreeTest, AValueExactlyOnAPlaneIsFoundFromBothSides) {
  // The middle of the bounds is x = 4, where a wall lies and where two boxes end.
  const std::vector<Object> objects = {box_object(1, {4, 0, 0}, {0, 1, 1}), box_object(2, {3, 0, 0}),
                                       box_object(3, {5, 0, 0}), point_object(4, {0, 0, 0}),
                                       point_object(5, {8, 0, 0})};
  for (const KdSplit split : kKdSplits)
    for (const CutValues cut : {CutValues::kInLeaves, CutValues::kAtNode}) {
      const auto tree = KdTree<Object>::build(objects, kd_options(split, cut));
      for (const double side : {-1.0, 1.0}) {
        std::vector<Object> boxes, balls;
        box_overlap(tree, {{4 + side * 0.5, 0, 0}, {0.5, 0.5, 0.5}, {}}, boxes);
        ball_overlap(tree, {{4 + side * 0.5, 0, 0}, 0.5}, balls);
        EXPECT_THAT(found_ids(boxes), UnorderedElementsAre(1, 2, 3));
        EXPECT_THAT(found_ids(balls), UnorderedElementsAre(1, 2, 3));
        std::vector<RayHit<Object>> hits;
        all_rays(tree, ObjectRay(Rayd{{4 + side * 9, 0, 0}, {-side, 0, 0}}), kUnlimited, 9, hits);
        EXPECT_EQ(hits.size(), 3u);  // rays do not hit points
        std::vector<ValueAt<Object>> nearest;
        nearest_values(tree, {4 + side, 0, 0}, 1, 9, nearest);
        EXPECT_EQ(nearest.size(), 3u);
      }
    }
}

TEST(KdTreeTest, ANodeKeepsItsAxisWhenItsTurnSeparatesNothing) {
  KdTreeOptions options = kd_options(KdSplit::kMedian);
  options.axis = KdAxis::kByTurns;  // the first turn is that of x, on which all points are equal
  std::vector<Object> points;
  for (uint32_t i = 0; i < 64; ++i) points.push_back(point_object(i + 1, {0, 0, double(i)}));
  const auto tree = KdTree<Object>::build(points, options);
  EXPECT_EQ(tree.shape().nodes, 127u);
  for (uint32_t i = 0; i < 64; ++i) {
    std::vector<Object> found;
    ball_overlap(tree, {{0, 0, double(i)}, 0.5}, found);
    EXPECT_THAT(found_ids(found), ElementsAre(i + 1));
  }
}

TEST(KdTreeTest, RemoveLeavesNoReference) {
  for (const CutValues cut : {CutValues::kInLeaves, CutValues::kAtNode}) {
    const std::vector<Object> objects = kd_boxes(200, 20, 5);
    auto tree = KdTree<Object>::build(objects, kd_options(KdSplit::kMedian, cut));
    for (const Object& object : objects) {
      EXPECT_TRUE(tree.remove(object));
      EXPECT_FALSE(tree.contains(object));
    }
    EXPECT_EQ(tree.size(), 0u);
    EXPECT_EQ(tree.shape().references, 0u);
    for (const Object& object : objects) tree.insert(object);
    EXPECT_EQ(tree.shape().references,
              KdTree<Object>::build(objects, kd_options(KdSplit::kMedian, cut)).shape().references);
  }
}

TEST(KdTreeTest, RemoveFindsAValueByItsIdWhereverTheCallerSaysItIs) {
  auto tree = KdTree<Object>::build(kd_points_on_axis(20), kd_options(KdSplit::kMedian));
  EXPECT_TRUE(tree.remove(point_object(7, {19, 5, 5})));
  EXPECT_FALSE(tree.contains(point_object(7, {6, 0, 0})));
  EXPECT_FALSE(tree.remove(point_object(99, {6, 0, 0})));
  EXPECT_EQ(tree.size(), 19u);
}

TEST(KdTreeTest, ObjectsInsertedFarOutsideTheFirstBoundsAreFound) {
  auto tree = KdTree<Object>::build(kd_points_on_axis(20), kd_options(KdSplit::kMedian));
  tree.insert(ball_object(50, {1e6, 0, 0}));
  tree.insert(ball_object(51, {10, -1e6, 0}));
  std::vector<Object> found;
  ball_overlap(tree, {{1e6, 0, 0}, 2}, found);
  EXPECT_THAT(found_ids(found), ElementsAre(50));
  EXPECT_TRUE(any_ray(tree, ObjectRay(Rayd{{10, -3e6, 0}, {0, 1, 0}}), kUnlimited));
  std::vector<ValueAt<Object>> nearest;
  nearest_values(tree, {10, -2e6, 0}, kUnlimited, 1, nearest);
  EXPECT_EQ(nearest[0].value.id, 51u);
}

TEST(KdTreeTest, RebuildRestoresTheShapeAfterInserts) {
  const std::vector<Object> objects = kd_boxes(500, 1, 7);
  KdTree<Object> tree(kd_options(KdSplit::kMedian));
  for (const Object& object : objects) tree.insert(object);
  EXPECT_EQ(tree.shape().nodes, 1u);
  tree.rebuild();
  const PlaneTreeShape fresh = KdTree<Object>::build(objects, kd_options(KdSplit::kMedian)).shape();
  EXPECT_EQ(tree.shape().nodes, fresh.nodes);
  EXPECT_EQ(tree.shape().references, fresh.references);
}

// The long box is in the first leaf on the ray, which hits the box only behind the ball (Hughes et al., Fig. 37.15).
TEST(KdTreeTest, AFartherHitInTheFirstLeafDoesNotHideANearerOneInALaterLeaf) {
  std::vector<Object> objects = {box_object(1, {10, 0, 0}, {10, 0.1f, 0.1f}), ball_object(2, {6, 3, 0})};
  objects[0].shape.rotation = normalized(Quaternion{0, 0, 0.3f, 1});
  for (Id id = 3; id < 40; ++id) objects.push_back(point_object(id, {double(id) / 2, 9, 0}));
  const auto tree = KdTree<Object>::build(objects, kd_options(KdSplit::kMiddle));
  Object hit;
  double t = kUnlimited;
  ASSERT_TRUE(first_ray(tree, ObjectRay(Rayd{{0, 3, 0}, {1, 0, 0}}), hit, t));
  EXPECT_EQ(hit.id, 2u);
  EXPECT_EQ(t, 5);
}

TEST(KdTreeTest, RaysVisitValuesFromNearToFar) {
  const auto tree = KdTree<Object>::build(kd_points_on_axis(100), kd_options(KdSplit::kMedian));
  for (const double sign : {1.0, -1.0}) {
    struct : KdCounter {
      std::vector<Id> ids;
      bool visit(const Object& object) {
        ids.push_back(object.id);
        return true;
      }
    } recorder;
    Work work;
    tree.visit_ray(ObjectRay(Rayd{{sign > 0 ? -5.0 : 105.0, 0, 0}, {sign, 0, 0}}).slabs(), recorder, work);
    ASSERT_EQ(recorder.ids.size(), 100u);
    for (Id i = 0; i < 100; ++i) EXPECT_EQ(recorder.ids[i], sign > 0 ? i + 1 : 100 - i);
  }
}

TEST(KdTreeTest, AShortRayOpensOnlyTheNodesThatItReaches) {
  const auto tree = KdTree<Object>::build(kd_points_on_axis(1'000), kd_options(KdSplit::kMedian));
  KdCounter counter;
  counter.end = 1;
  Work work;
  tree.visit_ray(ObjectRay(Rayd{{10.5, 0, 0}, {1, 0, 0}}).slabs(), counter, work);
  EXPECT_EQ(counter.count, 1u);
  EXPECT_LE(work.nodes, 2u * tree.shape().depth);
}

TEST(KdTreeTest, ANearestQueryOpensFewNodes) {
  const auto tree = KdTree<Object>::build(kd_points_on_axis(1'000), kd_options(KdSplit::kMedian));
  std::vector<ValueAt<Object>> nearest;
  Work work;
  nearest_values(tree, {700.2, 0, 0}, kUnlimited, 1, nearest, &work);
  EXPECT_EQ(nearest[0].value.id, 701u);
  EXPECT_LE(work.nodes, 2u * tree.shape().depth);
}

TEST(KdTreeTest, AVisitEndsWhenTheVisitorHasEnough) {
  std::vector<Object> balls;
  for (Id id = 1; id <= 100; ++id) balls.push_back(ball_object(id, {double(id) * 3, 0, 0}));
  const auto tree = KdTree<Object>::build(balls, kd_options(KdSplit::kMedian));
  Work work;
  EXPECT_TRUE(any_ray(tree, ObjectRay(Rayd{{-5, 0, 0}, {1, 0, 0}}), kUnlimited, &work));
  EXPECT_EQ(work.tests, 1u);
}

struct KdCentroidTraits : PrimitiveTraits<Triangle> {
  static Vec3f position(const Triangle& triangle) { return (triangle.a + triangle.b + triangle.c) * (1.0f / 3); }
};
struct KdLowestCornerTraits : PrimitiveTraits<Triangle> {
  static Vec3f position(const Triangle& triangle) { return bounds_of(triangle).min; }
};
static_assert(MutableSpatialIndex<KdTree<Triangle, KdCentroidTraits>>);

TEST(KdTreeTest, OneTypeLiesAtItsCentroidInOneTreeAndAtItsLowestCornerInAnother) {
  Random random(3);
  const TestScene<Triangle> scene = make_scene<Triangle>(random_scene(random), random);
  const std::vector<Triangle>& triangles = scene.values;
  const auto at_centroid = KdTree<Triangle, KdCentroidTraits>::build(triangles, kd_options(KdSplit::kMedian));
  const auto at_corner = KdTree<Triangle, KdLowestCornerTraits>::build(triangles, kd_options(KdSplit::kMedian));
  EXPECT_NE(at_centroid.shape().references, at_corner.shape().references) << "the trees do not differ";
  ListIndex<Triangle, KdCentroidTraits> centroid_list;
  ListIndex<Triangle, KdLowestCornerTraits> corner_list;
  for (const Triangle& triangle : triangles) {
    centroid_list.insert(triangle);
    corner_list.insert(triangle);
  }
  EXPECT_EQ(IndexJudge(at_centroid, centroid_list).difference(scene), "");
  EXPECT_EQ(IndexJudge(at_corner, corner_list).difference(scene), "");
}

}  // namespace
}  // namespace locus::test
