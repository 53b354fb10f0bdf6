// All spatial structures give the same results as the list, bit for bit, for every rule by which they divide space and
// every treatment of the values that a plane cuts. The suites named Long... run more scenes.
#include <gtest/gtest.h>

#include "tests/support/structure_comparison.h"

namespace locus::test {
namespace {

template <class Structure>
class StructuresEqualListTest : public ::testing::Test {};
TYPED_TEST_SUITE(StructuresEqualListTest, TypesOf<AllStructures>);

template <class Structure>
using ValueOf = typename Structure::Index::Value;

// Returns a value that extends by `half` from `center` on each axis, if that is possible for its type.
template <class V>
V value_at(Vec3d center, double half, uint32_t id) {
  if constexpr (std::same_as<V, Triangle>) {
    const Vec3f low = to_float(center - Vec3d{half, half, half}), high = to_float(center + Vec3d{half, half, half});
    return {low, high, {low.x, high.y, low.z}, id};
  } else {
    V object;
    object.id = id;
    object.shape.kind = half > 0 ? ShapeKind::kBox : ShapeKind::kPoint;
    object.shape.position = center;
    object.shape.size = to_float({half, half, half});
    return object;
  }
}

template <class V>
typename PrimitiveTraits<V>::RayQuery ray_query(Vec3d origin, Vec3d direction) {
  if constexpr (std::same_as<V, Triangle>) {
    return TriangleRay(origin, direction);
  } else {
    return ObjectRay(Rayd{origin, direction});
  }
}

// Makes a scene with queries but no values; `sketch` has placements for the queries only.
template <class V>
TestScene<V> queries_of(const SceneSketch& sketch, Random& random) {
  TestScene<V> scene = make_scene<V>(sketch, random);
  scene.values.clear();
  return scene;
}

TYPED_TEST(StructuresEqualListTest, OnRandomScenes) {
  EXPECT_EQ(search_structure_scenes<TypeParam>(scaled_count(100), 0), "");
}

TYPED_TEST(StructuresEqualListTest, OnAdversarialScenes) {
  EXPECT_EQ(search_structure_scenes<TypeParam>(0, scaled_count(90)), "");
}

TYPED_TEST(StructuresEqualListTest, OnAHundredThousandEqualValues) {
  using V = ValueOf<TypeParam>;
  std::vector<V> values;
  for (uint32_t i = 0; i < scaled_count(100'000); ++i) values.push_back(value_at<V>({1, 2, 3}, 0.5, i + 1));
  const auto index = TypeParam::make(values);
  EXPECT_EQ(shape_fault(index, values.size()), "");
  std::vector<V> found;
  ball_overlap(index, {{1, 2, 3}, 1}, found);
  EXPECT_EQ(found.size(), values.size());
  std::vector<ValueAt<V>> nearest;
  nearest_values(index, {9, 9, 9}, 1e9, 3, nearest);
  ASSERT_EQ(nearest.size(), 3u);
  for (uint64_t i = 0; i < 3; ++i) EXPECT_EQ(PrimitiveTraits<V>::id(nearest[i].value), i + 1);
  V first{};
  ScalarOf<V> distance = 100;
  const typename PrimitiveTraits<V>::RayQuery ray = ray_query<V>({1, 2, -9}, {-0.1, 0.1, 12});
  EXPECT_TRUE(first_ray(index, ray, first, distance));
  EXPECT_EQ(PrimitiveTraits<V>::id(first), 1u);
}

// A dense hub of small values in a country that is a million times as wide.
TYPED_TEST(StructuresEqualListTest, OnAHubInAWideCountry) {
  using V = ValueOf<TypeParam>;
  Random random(7);
  SceneSketch sketch{"hub and country", {}, {}, {}, {}};
  for (int i = 0; i < 10; ++i) sketch.placements.push_back({random.vector(i < 5 ? 1 : 1e6), {}, {}});
  add_queries(sketch, 10, 0.2, random);
  add_queries(sketch, 10, 1e5, random);
  TestScene<V> scene = queries_of<V>(sketch, random);
  for (uint32_t i = 0; i < 1'000; ++i)
    scene.values.push_back(value_at<V>(random.vector(i % 20 == 0 ? 1e6 : 1), i % 20 == 0 ? 100 : 0.01, i + 1));
  EXPECT_EQ(structure_difference<TypeParam>(scene), "");
}

template <class Structure>
class MutableStructuresEqualListTest : public ::testing::Test {};
TYPED_TEST_SUITE(MutableStructuresEqualListTest, TypesOf<MutableOf<AllStructures>>);

TYPED_TEST(MutableStructuresEqualListTest, ThroughTenThousandInsertsAndRemoves) {
  using V = ValueOf<TypeParam>;
  Random random(11);
  const TestScene<V> scene = queries_of<V>(random_scene(random), random);
  std::vector<V> values;
  for (uint32_t i = 0; i < 100; ++i) values.push_back(value_at<V>(random.vector(4), random.unit(), i + 1));
  auto index = TypeParam::make(values);
  ListIndex<V> list = make_list(values);
  uint32_t next = 1'000;
  for (uint64_t change = 0; change < scaled_count(10'000); ++change) {
    if (values.size() < 50 || (values.size() < 150 && random.chance(0.5))) {
      const double drift = 4 + static_cast<double>(change) / 500;
      values.push_back(value_at<V>(random.vector(drift), random.unit(), ++next));
      index.insert(values.back());
      list.insert(values.back());
    } else {
      std::swap(values[random.below(values.size())], values.back());
      ASSERT_TRUE(index.remove(values.back())) << "change " << change;
      ASSERT_TRUE(list.remove(values.back()));
      values.pop_back();
    }
    if (change % 500 == 0) {
      ASSERT_EQ(IndexJudge(index, list).difference(scene), "") << "change " << change;
    }
  }
  EXPECT_EQ(IndexJudge(index, list).difference(scene), "");
  if constexpr (requires { index.rebuild(); }) {
    index.rebuild();
    EXPECT_EQ(IndexJudge(index, list).difference(scene), "") << "after the rebuild";
    EXPECT_EQ(shape_fault(index, list.size()), "");
  }
}

template <class Structure>
class LongStructuresEqualListTest : public ::testing::Test {};
TYPED_TEST_SUITE(LongStructuresEqualListTest, TypesOf<AllStructures>);

TYPED_TEST(LongStructuresEqualListTest, OnRandomAndAdversarialScenes) {
  EXPECT_EQ(search_structure_scenes<TypeParam>(scaled_count(10'000), scaled_count(1'200)), "");
}

}  // namespace
}  // namespace locus::test
