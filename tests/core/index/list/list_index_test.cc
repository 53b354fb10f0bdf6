#include "core/index/list/list_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/objects/object.h"
#include "tests/support/random.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAreArray;

static_assert(MutableSpatialIndex<ListIndex<Triangle>>);
static_assert(MutableSpatialIndex<ListIndex<Object>>);

Object point(Id id, double x = 0) {
  Object object;
  object.id = id;
  object.shape.position = {x, 0, 0};
  return object;
}

std::vector<Id> ids_of(const ListIndex<Object>& list) {
  std::vector<Id> ids;
  for (const Object& object : list.values()) ids.push_back(object.id);
  return ids;
}

// Visitor that records ids and ends the visit after `max_ids`.
struct IdRecorder {
  size_t max_ids;
  std::vector<Id> ids;

  double limit() const { return 0; }
  Aabbd bounds() const { return {}; }
  bool overlaps(const Aabbd&) const { return false; }
  bool visit(const Object& object) {
    ids.push_back(object.id);
    return ids.size() < max_ids;
  }
};

TEST(ListIndexTest, AFreshListIsEmpty) {
  const ListIndex<Object> list;
  EXPECT_EQ(list.size(), 0u);
  EXPECT_FALSE(list.contains(point(1)));
  EXPECT_TRUE(list.values().empty());
}

TEST(ListIndexTest, RemoveFillsTheHoleWithTheLastValue) {
  ListIndex<Object> list;
  for (Id id = 1; id <= 4; ++id) list.insert(point(id));
  EXPECT_TRUE(list.remove(point(2)));
  EXPECT_THAT(ids_of(list), ElementsAre(1, 4, 3));
  EXPECT_TRUE(list.remove(point(4)));
  EXPECT_THAT(ids_of(list), ElementsAre(1, 3));
}

TEST(ListIndexTest, RemoveOfTheLastValueMovesNoOther) {
  ListIndex<Object> list;
  for (Id id = 1; id <= 3; ++id) list.insert(point(id));
  EXPECT_TRUE(list.remove(point(3)));
  EXPECT_THAT(ids_of(list), ElementsAre(1, 2));
}

TEST(ListIndexTest, RemoveOfAnAbsentIdReturnsFalseAndChangesNothing) {
  ListIndex<Object> list;
  list.insert(point(7));
  EXPECT_FALSE(list.remove(point(8)));
  EXPECT_THAT(ids_of(list), ElementsAre(7));
  EXPECT_TRUE(list.remove(point(7)));
  EXPECT_FALSE(list.remove(point(7)));
}

TEST(ListIndexTest, RemoveAndContainsCompareOnlyIds) {
  ListIndex<Object> list;
  list.insert(point(7, 1.0));
  EXPECT_TRUE(list.contains(point(7, 2.0)));
  EXPECT_TRUE(list.remove(point(7, 2.0)));
  EXPECT_EQ(list.size(), 0u);
}

TEST(ListIndexTest, ARemovedIdCanBeInsertedAgainWithAnotherValue) {
  ListIndex<Object> list;
  list.insert(point(7, 1.0));
  EXPECT_TRUE(list.remove(point(7)));
  list.insert(point(7, 2.0));
  EXPECT_EQ(list.values()[0], point(7, 2.0));
}

TEST(ListIndexDeathTest, InsertOfAPresentIdIsAProgrammerError) {
  ListIndex<Object> list;
  list.insert(point(7));
  EXPECT_DEATH(list.insert(point(7)), "check failed");
}

TEST(ListIndexTest, EqualsASetThroughRandomUpdates) {
  constexpr uint64_t kSeed = 11;
  Random random(kSeed);
  ListIndex<Object> list;
  std::vector<Id> expected;
  for (int step = 0; step < 5'000; ++step) {
    const Id id = 1 + random.below(60);
    const auto found = std::find(expected.begin(), expected.end(), id);
    const bool present = found != expected.end();
    ASSERT_EQ(list.contains(point(id)), present) << "seed " << kSeed << " step " << step;
    if (random.chance(0.5)) {
      ASSERT_EQ(list.remove(point(id)), present) << "seed " << kSeed << " step " << step;
      if (present) expected.erase(found);
    } else if (!present) {
      list.insert(point(id));
      expected.push_back(id);
    }
    ASSERT_THAT(ids_of(list), UnorderedElementsAreArray(expected)) << "seed " << kSeed << " step " << step;
  }
}

TEST(ListIndexTest, VisitsPassEveryValueAndCountIt) {
  ListIndex<Object> list;
  for (Id id = 1; id <= 3; ++id) list.insert(point(id, 1e6 * static_cast<double>(id)));
  Work work;
  IdRecorder on_ray{99, {}}, in_region{99, {}};
  list.visit_ray(SlabRay<double>({{}, {0, 1, 0}}, kObjectPad), on_ray, work);
  list.visit_region(in_region, work);
  EXPECT_THAT(on_ray.ids, ElementsAre(1, 2, 3));
  EXPECT_THAT(in_region.ids, ElementsAre(1, 2, 3));
  EXPECT_EQ(work.tests, 6u);
  EXPECT_EQ(work.nodes, 0u);
}

TEST(ListIndexTest, AVisitEndsWhenTheVisitorReturnsFalse) {
  ListIndex<Object> list;
  for (Id id = 1; id <= 5; ++id) list.insert(point(id));
  Work work;
  IdRecorder first_two{2, {}};
  list.visit_region(first_two, work);
  EXPECT_THAT(first_two.ids, ElementsAre(1, 2));
  EXPECT_EQ(work.tests, 2u);
}

}  // namespace
}  // namespace locus::test
