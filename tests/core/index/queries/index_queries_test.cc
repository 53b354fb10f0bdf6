#include "core/index/queries/index_queries.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/index_structures.h"
#include "tests/support/random.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

constexpr double kNoEnd = std::numeric_limits<double>::infinity();

ObjectRay along_x() { return ObjectRay(Rayd{{0, 0, 0}, {1, 0, 0}}); }

// Fixture that runs each test for every structure.
template <class Structure>
class IndexQueriesTest : public ::testing::Test {
 protected:
  static typename Structure::Index make(const std::vector<Object>& objects) { return Structure::make(objects); }
};
TYPED_TEST_SUITE(IndexQueriesTest, TypesOf<ObjectStructures>);

std::vector<Id> ids_found(const std::vector<Object>& objects) {
  std::vector<Id> ids;
  for (const Object& object : objects) ids.push_back(object.id);
  return ids;
}

std::vector<Id> ids_found(const std::vector<RayHit<Object>>& hits) {
  std::vector<Id> ids;
  for (const RayHit<Object>& hit : hits) ids.push_back(hit.value.id);
  return ids;
}

TYPED_TEST(IndexQueriesTest, FirstRayWithoutAHitChangesNeitherValueNorDistance) {
  const auto index = this->make({ball_object(1, {-10, 0, 0})});
  Object value = ball_object(77, {0, 0, 0});
  double distance = 100;
  EXPECT_FALSE(first_ray(index, along_x(), value, distance));
  EXPECT_EQ(value, ball_object(77, {0, 0, 0}));
  EXPECT_EQ(distance, 100);
}

TYPED_TEST(IndexQueriesTest, FirstRayWithANearerHitSetsValueAndDistance) {
  const auto index = this->make({ball_object(1, {30, 0, 0}), ball_object(2, {10, 0, 0}), ball_object(3, {20, 0, 0})});
  Object value = ball_object(77, {0, 0, 0});
  double distance = 100;
  EXPECT_TRUE(first_ray(index, along_x(), value, distance));
  EXPECT_EQ(value, ball_object(2, {10, 0, 0}));
  EXPECT_EQ(distance, 9);
}

TYPED_TEST(IndexQueriesTest, FirstRayWithAHitAtOrBeyondTheDistanceChangesNeitherValueNorDistance) {
  const auto index = this->make({ball_object(1, {10, 0, 0})});
  for (const double limit : {9.0, 8.0, 0.0}) {
    Object value = ball_object(77, {0, 0, 0});
    double distance = limit;
    EXPECT_FALSE(first_ray(index, along_x(), value, distance)) << limit;
    EXPECT_EQ(value, ball_object(77, {0, 0, 0}));
    EXPECT_EQ(distance, limit);
  }
}

TYPED_TEST(IndexQueriesTest, FirstRayAcceptsAHitJustBeforeTheDistance) {
  const auto index = this->make({ball_object(1, {10, 0, 0})});
  Object value;
  double distance = std::nextafter(9.0, kNoEnd);
  EXPECT_TRUE(first_ray(index, along_x(), value, distance));
  EXPECT_EQ(distance, 9);
}

TYPED_TEST(IndexQueriesTest, TheLowerIdWinsATie) {
  std::vector<Object> objects;
  for (const Id id : {40, 12, 7, 33, 21, 8, 9, 10, 11, 13, 14, 15}) objects.push_back(ball_object(id, {10, 0, 0}));
  const auto index = this->make(objects);
  Object value;
  double distance = kNoEnd;
  EXPECT_TRUE(first_ray(index, along_x(), value, distance));
  EXPECT_EQ(value.id, 7u);
}

TYPED_TEST(IndexQueriesTest, AnyRayIsStrictAtTheDistance) {
  const auto index = this->make({ball_object(1, {10, 0, 0}), ball_object(2, {50, 0, 0})});
  EXPECT_FALSE(any_ray(index, along_x(), 9));
  EXPECT_TRUE(any_ray(index, along_x(), std::nextafter(9.0, kNoEnd)));
  EXPECT_FALSE(any_ray(this->make({}), along_x(), kNoEnd));
}

TYPED_TEST(IndexQueriesTest, AllRaysSortByDistanceThenId) {
  const auto index = this->make({ball_object(9, {30, 0, 0}), ball_object(2, {10, 0, 0}), ball_object(5, {20, 0, 0}),
                                 ball_object(1, {30, 0, 0}), ball_object(8, {10, 0, 0})});
  std::vector<RayHit<Object>> hits;
  all_rays(index, along_x(), kNoEnd, 100, hits);
  EXPECT_THAT(ids_found(hits), ElementsAre(2, 8, 5, 1, 9));
  EXPECT_EQ(hits[2].distance, 19);
}

TYPED_TEST(IndexQueriesTest, AllRaysReturnTheNearestHits) {
  const auto index = this->make({ball_object(9, {30, 0, 0}), ball_object(2, {10, 0, 0}), ball_object(5, {20, 0, 0}),
                                 ball_object(1, {30, 0, 0}), ball_object(8, {10, 0, 0})});
  for (size_t max_hits = 0; max_hits <= 5; ++max_hits) {
    std::vector<RayHit<Object>> hits;
    all_rays(index, along_x(), kNoEnd, max_hits, hits);
    const std::vector<Id> expected = {2, 8, 5, 1, 9};
    EXPECT_EQ(ids_found(hits), std::vector<Id>(expected.begin(), expected.begin() + static_cast<ptrdiff_t>(max_hits)));
  }
}

TYPED_TEST(IndexQueriesTest, AllRaysAreStrictAtTheDistance) {
  const auto index = this->make({ball_object(1, {10, 0, 0}), ball_object(2, {20, 0, 0})});
  std::vector<RayHit<Object>> hits;
  all_rays(index, along_x(), 19, 100, hits);
  EXPECT_THAT(ids_found(hits), ElementsAre(1));
}

TYPED_TEST(IndexQueriesTest, ResultsAreAppendedAndNeverOverwritten) {
  const auto index = this->make({ball_object(1, {10, 0, 0}), ball_object(2, {20, 0, 0})});
  // The given vector contains a hit that is farther than every hit of the ray, so that a sort of the whole vector would
  // move it.
  std::vector<RayHit<Object>> hits = {{1e9, ball_object(77, {0, 0, 0})}};
  all_rays(index, along_x(), kNoEnd, 1, hits);
  EXPECT_THAT(ids_found(hits), ElementsAre(77, 1));
  all_rays(index, along_x(), kNoEnd, 2, hits);
  EXPECT_THAT(ids_found(hits), ElementsAre(77, 1, 1, 2));

  std::vector<Object> values = {ball_object(77, {0, 0, 0})};
  ball_overlap(index, {{10, 0, 0}, 1}, values);
  box_overlap(index, {{20, 0, 0}, {1, 1, 1}, {}}, values);
  conservative_ball(index, {{10, 0, 0}, 1}, values);
  conservative_box(index, {{20, 0, 0}, {1, 1, 1}, {}}, values);
  conservative_ray(index, along_x(), 15, values);
  EXPECT_THAT(ids_found(values), ElementsAre(77, 1, 2, 1, 2, 1));
}

TYPED_TEST(IndexQueriesTest, TouchingCountsAsOverlap) {
  const auto index = this->make({ball_object(1, {10, 0, 0})});
  std::vector<Object> values;
  ball_overlap(index, {{13, 0, 0}, 2}, values);
  box_overlap(index, {{7, 0, 0}, {2, 0, 0}, {}}, values);
  EXPECT_THAT(ids_found(values), ElementsAre(1, 1));
  values.clear();
  ball_overlap(index, {{13, 0, 0}, 1.999}, values);
  box_overlap(index, {{7, 0, 0}, {1.999, 0, 0}, {}}, values);
  EXPECT_THAT(ids_found(values), ElementsAre());
}

TYPED_TEST(IndexQueriesTest, ConservativeQueriesDecideByBounds) {
  // The queries (a ball, a box and a ray) overlap the stored ball's bounds at a corner, but not the stored ball.
  const auto index = this->make({ball_object(1, {0, 0, 0}, 10)});
  const Balld ball{{10, 10, 10}, 1};
  const Obbd box{{10, 10, 10}, {1, 1, 1}, {}};
  const ObjectRay ray(Rayd{{9.5, 9.5, -20}, {0, 0, 1}});
  std::vector<Object> exact, conservative;
  std::vector<RayHit<Object>> hits;
  ball_overlap(index, ball, exact);
  box_overlap(index, box, exact);
  all_rays(index, ray, kNoEnd, 9, hits);
  EXPECT_TRUE(exact.empty());
  EXPECT_TRUE(hits.empty());
  conservative_ball(index, ball, conservative);
  conservative_box(index, box, conservative);
  conservative_ray(index, ray, kNoEnd, conservative);
  EXPECT_THAT(ids_found(conservative), ElementsAre(1, 1, 1));
}

TYPED_TEST(IndexQueriesTest, WorkIsAddedToTheCallersCounter) {
  const auto index = this->make({ball_object(1, {10, 0, 0}), ball_object(2, {20, 0, 0})});
  Work work;
  work.tests = 100;
  std::vector<RayHit<Object>> hits;
  all_rays(index, along_x(), kNoEnd, 9, hits, &work);
  EXPECT_EQ(work.tests, 102u);
  std::vector<Object> values;
  ball_overlap(index, {{0, 0, 0}, 100}, values, &work);
  EXPECT_EQ(work.tests, 104u);
}

// The expression first_ray(statics) || first_ray(dynamics) does not search `dynamics` after a hit in `statics`,
// although `dynamics` may have a nearer hit.
TYPED_TEST(IndexQueriesTest, TheNearerHitOfASecondIndexIsNotSkippedAfterAHitInTheFirst) {
  const auto statics = this->make({ball_object(1, {50, 0, 0})});
  const auto dynamics = this->make({ball_object(2, {10, 0, 0})});
  Object joined;
  double joined_distance = kNoEnd;
  const bool hit =
      first_ray(statics, along_x(), joined, joined_distance) || first_ray(dynamics, along_x(), joined, joined_distance);
  ASSERT_TRUE(hit);
  ASSERT_EQ(joined.id, 1u) << "joined calls no longer skip the second index";

  Object value;
  double distance = kNoEnd;
  EXPECT_TRUE(first_ray_of(along_x(), value, distance, nullptr, statics, dynamics));
  EXPECT_EQ(value.id, 2u);
  EXPECT_EQ(distance, 9);
}

TYPED_TEST(IndexQueriesTest, FirstRayOfSeveralIndicesDoesNotDependOnTheirOrder) {
  const auto far = this->make({ball_object(1, {50, 0, 0}), ball_object(9, {20, 0, 0})});
  const auto near = this->make({ball_object(2, {10, 0, 0})});
  const auto tied = this->make({ball_object(3, {10, 0, 0}), ball_object(4, {11, 0, 0})});
  const auto none = this->make({});
  const auto check = [](const auto&... indices) {
    Object value;
    double distance = kNoEnd;
    EXPECT_TRUE(first_ray_of(along_x(), value, distance, nullptr, indices...));
    EXPECT_EQ(value.id, 2u);
    EXPECT_EQ(distance, 9);
  };
  check(far, near, tied, none);
  check(none, tied, near, far);
  check(tied, none, far, near);
}

TEST(IndexQueriesOfTwoStructuresTest, FirstRayOfAListAndATreeReturnsTheNearerHitOrTheLowerId) {
  ListIndex<Object> list;
  list.insert(ball_object(5, {10, 0, 0}));
  const Bvh<Object> tree = *Bvh<Object>::build({ball_object(4, {10, 0, 0}), ball_object(6, {9, 0, 0})});
  Object value;
  double distance = kNoEnd;
  EXPECT_TRUE(first_ray_of(along_x(), value, distance, nullptr, list, tree));
  EXPECT_EQ(value.id, 6u);
  distance = kNoEnd;
  const Bvh<Object> tied = *Bvh<Object>::build({ball_object(4, {10, 0, 0}), ball_object(6, {10, 0, 0})});
  EXPECT_TRUE(first_ray_of(along_x(), value, distance, nullptr, list, tied));
  EXPECT_EQ(value.id, 4u);
}

}  // namespace
}  // namespace locus::test
