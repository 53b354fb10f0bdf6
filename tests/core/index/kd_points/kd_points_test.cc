// Points in one to four dimensions answer as a search of all points does, in float and in double.
#include "core/index/kd_points/kd_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/point_comparison.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;

template <class Kind>
class KdPointsTest : public ::testing::Test {};
using PointKinds =
    ::testing::Types<PointKind<float, 1>, PointKind<float, 2>, PointKind<float, 3>, PointKind<float, 4>,
                     PointKind<double, 1>, PointKind<double, 2>, PointKind<double, 3>, PointKind<double, 4>>;
TYPED_TEST_SUITE(KdPointsTest, PointKinds);

TYPED_TEST(KdPointsTest, EveryQueryEqualsASearchOfAllPoints) {
  EXPECT_EQ((points_difference<typename TypeParam::Scalar, TypeParam::kDimensions>(scaled_count(200))), "");
}

TYPED_TEST(KdPointsTest, NoPointsAnswerNothing) {
  const KdPoints<typename TypeParam::Scalar, TypeParam::kDimensions> points;
  Work work;
  std::vector<typename decltype(points)::PointAt> nearest;
  points.nearest({}, 1e9, 5, nearest, work);
  points.visit_ball(
      {}, 1e9, [](const auto&) { return true; }, work);
  EXPECT_TRUE(nearest.empty());
  EXPECT_EQ(work.tests, 0u);
}

std::vector<KdPoint<double, 1>> points_of_time(uint64_t count) {
  std::vector<KdPoint<double, 1>> points;
  for (uint64_t i = 0; i < count; ++i) points.push_back({{static_cast<double>(i)}, i});
  return points;
}

TEST(KdPointsOfTimeTest, APointOnTheBorderOfABoxOrBallIsFound) {
  const auto points = KdPoints<double, 1>::build(points_of_time(100));
  std::vector<uint64_t> ids;
  const auto add = [&ids](const auto& point) {
    ids.push_back(point.id);
    return true;
  };
  Work work;
  points.visit_box({50}, {52}, add, work);
  std::sort(ids.begin(), ids.end());
  EXPECT_THAT(ids, ElementsAre(50, 51, 52));
  ids.clear();
  points.visit_ball({51}, 1, add, work);
  std::sort(ids.begin(), ids.end());
  EXPECT_THAT(ids, ElementsAre(50, 51, 52));
}

TEST(KdPointsOfTimeTest, AVisitEndsWhenTheFunctionReturnsFalse) {
  const auto points = KdPoints<double, 1>::build(points_of_time(100));
  Work work;
  points.visit_box(
      {0}, {99}, [](const auto&) { return false; }, work);
  points.visit_ball(
      {50}, 99, [](const auto&) { return false; }, work);
  EXPECT_EQ(work.tests, 2u);
}

TEST(KdPointsOfTimeTest, NearestPointsTieByIdAndAreAppended) {
  const auto points = KdPoints<double, 1>::build({{{4}, 9}, {{6}, 3}, {{5}, 7}, {{5}, 2}});
  std::vector<KdPointAt<double, 1>> nearest = {{7, {{0}, 77}}};
  Work work;
  points.nearest({5}, 1, 3, nearest, work);
  ASSERT_EQ(nearest.size(), 4u);
  EXPECT_EQ(nearest[0].point.id, 77u);
  EXPECT_EQ(nearest[1].point.id, 2u);
  EXPECT_EQ(nearest[2].point.id, 7u);
  EXPECT_EQ(nearest[3].point.id, 3u);
}

TEST(KdPointsOfTimeTest, SmallQueriesCompareFewOfManyPoints) {
  const auto points = KdPoints<double, 1>::build(points_of_time(100'000));
  Work work;
  std::vector<KdPointAt<double, 1>> nearest;
  points.nearest({500.3}, 1e9, 1, nearest, work);
  points.visit_box(
      {7.5}, {8.5}, [](const auto&) { return true; }, work);
  EXPECT_LE(work.cells, 100u);
}

}  // namespace
}  // namespace locus::test
