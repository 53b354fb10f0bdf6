#include "core/geometry/callable_traits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/index/bvh/bvh.h"
#include "core/index/kd_tree/kd_tree.h"
#include "core/index/list/list_index.h"
#include "core/index/queries/index_queries.h"
#include "core/index/queries/nearest_values.h"
#include "tests/support/random.h"

namespace locus::test {
namespace {

static_assert(Primitive<Called<int>> && Measurable<Called<int>>);
static_assert(MutableSpatialIndex<KdTree<Called<int>>>);

// A type without traits of its own: a parcel on a shelf, with a cell of the shelf instead of coordinates.
struct Parcel {
  uint64_t number;
  int column, row;
};

Aabbd cell_of(const Parcel& parcel) {
  const Vec3d low = {double(parcel.column), double(parcel.row), 0};
  return {low, low + Vec3d{1, 1, 1}};
}

// Callables of parcels that fill their cells.
ValueCallables<Parcel> callables_of_parcels() {
  ValueCallables<Parcel> callables;
  callables.id = [](const Parcel& parcel) { return parcel.number; };
  callables.bounds = cell_of;
  callables.position = [](const Parcel& parcel) { return cell_of(parcel).min; };
  callables.ray = [](const Parcel& parcel, const ObjectRay& ray) {
    return std::optional<double>(ray.slabs().interval(cell_of(parcel)).near);
  };
  callables.ball = [](const Parcel&, const Balld&) { return true; };
  callables.box = [](const Parcel&, const Obbd&) { return true; };
  callables.distance = [](const Parcel&, const Vec3d&) { return 0.0; };
  return callables;
}

std::vector<Called<Parcel>> shelf(const ValueCallables<Parcel>& callables) {
  Random random(4);
  std::vector<Called<Parcel>> parcels;
  for (uint64_t i = 0; i < 200; ++i) parcels.push_back({{i, random.whole(-9, 9), random.whole(-9, 9)}, &callables});
  return parcels;
}

using Ids = std::vector<uint64_t>;
Ids numbers_of(const std::vector<Called<Parcel>>& parcels) {
  Ids ids;
  for (const Called<Parcel>& parcel : parcels) ids.push_back(parcel.value.number);
  std::sort(ids.begin(), ids.end());
  return ids;
}

// Returns the answers of an index to several queries around a point.
template <class Index>
std::vector<Ids> answers_around(const Index& index, Vec3d point, Vec3d direction) {
  std::vector<Called<Parcel>> ball, box;
  ball_overlap(index, {point, 1.5}, ball);
  box_overlap(index, {point, {1, 1, 1}, {}}, box);
  std::vector<RayHit<Called<Parcel>>> hits;
  all_rays(index, ObjectRay(Rayd{point, direction}), 10, 5, hits);
  std::vector<ValueAt<Called<Parcel>>> nearest;
  nearest_values(index, point, 10, 5, nearest);
  std::vector<Ids> result = {numbers_of(ball), numbers_of(box), {}, {}};
  for (const auto& hit : hits) result[2].push_back(hit.value.value.number);
  for (const auto& value : nearest) result[3].push_back(value.value.value.number);
  return result;
}

TEST(CallableTraitsTest, EveryStructureStoresATypeByCallables) {
  const ValueCallables<Parcel> callables = callables_of_parcels();
  const std::vector<Called<Parcel>> parcels = shelf(callables);
  ListIndex<Called<Parcel>> list;
  for (const Called<Parcel>& parcel : parcels) list.insert(parcel);
  const auto tree = KdTree<Called<Parcel>>::build(parcels);
  const auto bvh = *Bvh<Called<Parcel>>::build(parcels);
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Vec3d point = random.vector(10), direction = random.unit_vector();
    const std::vector<Ids> expected = answers_around(list, point, direction);
    EXPECT_EQ(answers_around(tree, point, direction), expected) << i;
    EXPECT_EQ(answers_around(bvh, point, direction), expected) << i;
    EXPECT_EQ(expected[3].size(), 5u);
  }
}

TEST(CallableTraitsTest, OneTypeHasDifferentTraitsInTwoIndexes) {
  const ValueCallables<Parcel> cells = callables_of_parcels();
  ValueCallables<Parcel> mirrored = cells;
  mirrored.bounds = [](const Parcel& parcel) {
    const Aabbd cell = cell_of(parcel);
    return Aabbd{-cell.max, -cell.min};
  };
  const Parcel parcel = {1, 5, 5};
  const auto tree = KdTree<Called<Parcel>>::build({{parcel, &cells}});
  const auto mirrored_tree = KdTree<Called<Parcel>>::build({{parcel, &mirrored}});
  std::vector<Called<Parcel>> found, mirrored_found;
  ball_overlap(tree, {{5.5, 5.5, 0.5}, 1}, found);
  ball_overlap(mirrored_tree, {{5.5, 5.5, 0.5}, 1}, mirrored_found);
  EXPECT_EQ(found.size(), 1u);
  EXPECT_TRUE(mirrored_found.empty());
  ball_overlap(mirrored_tree, {{-5.5, -5.5, -0.5}, 1}, mirrored_found);
  EXPECT_EQ(mirrored_found.size(), 1u);
}

TEST(CallableTraitsTest, DistancesAreMovedIntoTheRangeOfTheBounds) {
  ValueCallables<Parcel> callables = callables_of_parcels();
  callables.ray = [](const Parcel&, const ObjectRay&) { return std::optional<double>(0.0); };
  const Called<Parcel> parcel = {{1, 5, 0}, &callables};
  using Traits = PrimitiveTraits<Called<Parcel>>;
  EXPECT_EQ(Traits::distance(parcel, {2, 0, 0}), 3);
  EXPECT_NEAR(*Traits::ray(parcel, ObjectRay(Rayd{{2, 0.5, 0.5}, {1, 0, 0}})), 3, 1e-9);
  EXPECT_FALSE(Traits::ray(parcel, ObjectRay(Rayd{{2, 0.5, 0.5}, {-1, 0, 0}})));
  EXPECT_FALSE(Traits::ball(parcel, {{2, 0, 0}, 2.9}));
}

TEST(CallableTraitsDeathTest, AQueryWithoutItsCallableFails) {
  ValueCallables<Parcel> callables = callables_of_parcels();
  callables.ball = {};
  const Called<Parcel> parcel = {{1, 0, 0}, &callables};
  EXPECT_DEATH(PrimitiveTraits<Called<Parcel>>::ball(parcel, {{0, 0, 0}, 1}), "function");
}

}  // namespace
}  // namespace locus::test
