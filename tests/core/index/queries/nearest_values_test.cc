#include "core/index/queries/nearest_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/index/bvh/bvh.h"
#include "core/index/list/list_index.h"
#include "tests/support/object_grid.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

// Fixture that runs each test for every index structure.
template <class Index>
class NearestValuesTest : public ::testing::Test {
 protected:
  static Index make(const std::vector<Object>& objects) {
    if constexpr (MutableSpatialIndex<Index>) {
      Index index;
      for (const Object& object : objects) index.insert(object);
      return index;
    } else {
      return *Index::build(objects);
    }
  }

  static std::vector<Id> nearest(const Index& index, double max_distance, size_t count) {
    std::vector<ValueAt<Object>> found;
    nearest_values(index, Vec3d{}, max_distance, count, found);
    std::vector<Id> ids;
    for (const ValueAt<Object>& at : found) ids.push_back(at.value.id);
    return ids;
  }
};

using NearestStructures = ::testing::Types<ListIndex<Object>, Bvh<Object>, ObjectGrid>;
TYPED_TEST_SUITE(NearestValuesTest, NearestStructures);

TYPED_TEST(NearestValuesTest, ResultsAscendByDistanceThenId) {
  const auto index = this->make({ball_object(9, {30, 0, 0}), ball_object(2, {-10, 0, 0}), ball_object(5, {20, 0, 0}),
                                 ball_object(1, {-30, 0, 0}), ball_object(8, {10, 0, 0})});
  EXPECT_THAT(this->nearest(index, kNoLimit, 100), ElementsAre(2, 8, 5, 1, 9));
  EXPECT_THAT(this->nearest(index, kNoLimit, 2), ElementsAre(2, 8));
  EXPECT_THAT(this->nearest(index, kNoLimit, 4), ElementsAre(2, 8, 5, 1));
  EXPECT_THAT(this->nearest(index, kNoLimit, 0), IsEmpty());
}

TYPED_TEST(NearestValuesTest, TheMaximumDistanceIsIncluded) {
  const auto index = this->make({ball_object(2, {10, 0, 0}), ball_object(5, {20, 0, 0})});
  EXPECT_THAT(this->nearest(index, 19, 9), ElementsAre(2, 5));
  EXPECT_THAT(this->nearest(index, std::nextafter(19.0, 0.0), 9), ElementsAre(2));
  EXPECT_THAT(this->nearest(index, 0, 9), IsEmpty());
}

TYPED_TEST(NearestValuesTest, SolidsThatContainThePointHaveDistanceZero) {
  const auto index =
      this->make({ball_object(3, {10, 0, 0}, 30), ball_object(2, {10, 0, 0}, 10), ball_object(5, {20, 0, 0})});
  std::vector<ValueAt<Object>> found;
  nearest_values(index, Vec3d{}, 0, 9, found);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].value.id, 2u);
  EXPECT_EQ(found[0].distance, 0);
  EXPECT_EQ(found[1].value.id, 3u);
  EXPECT_EQ(found[1].distance, 0);
}

TYPED_TEST(NearestValuesTest, AnEmptyIndexGivesNoResults) {
  EXPECT_THAT(this->nearest(this->make({}), kNoLimit, 3), IsEmpty());
}

TYPED_TEST(NearestValuesTest, ResultsAreAppendedAndWorkIsAdded) {
  const auto index = this->make({ball_object(2, {10, 0, 0})});
  std::vector<ValueAt<Object>> found = {{0, ball_object(7, {0, 0, 0})}};
  Work work;
  work.tests = 100;
  nearest_values(index, Vec3d{}, kNoLimit, 1, found, &work);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].value.id, 7u);
  EXPECT_EQ(found[1].value.id, 2u);
  EXPECT_EQ(found[1].distance, 9);
  EXPECT_EQ(work.tests, 101u);
}

TEST(NearestWorkTest, ATreeTestsFewValuesBesidesTheNearest) {
  std::vector<Object> objects;
  for (Id id = 1; id <= 4096; ++id) objects.push_back(ball_object(id, {4.0 * static_cast<double>(id), 0, 0}));
  const Bvh<Object> tree = *Bvh<Object>::build(objects);
  std::vector<ValueAt<Object>> found;
  Work work;
  nearest_values(tree, Vec3d{8000, 3, 0}, kNoLimit, 4, found, &work);
  EXPECT_EQ(found.size(), 4u);
  EXPECT_LE(work.tests, 32u);
}

}  // namespace
}  // namespace locus::test
