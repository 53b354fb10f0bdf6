#include "core/query/kinds/placed_triangle.h"

#include <gtest/gtest.h>

#include "tests/support/query_world.h"
#include "tests/support/real.h"

namespace locus::test {
namespace {

constexpr double kFarPlaces[] = {0, 1, 1e6, 1e9};

Instance random_instance(Random& random) {
  std::vector<Triangle> triangles;
  const double lever = random.chance(0.3) ? 1e6 : 0;
  const Vec3f offset = random.float_vector(lever);
  for (uint32_t i = 0; i < 5; ++i)
    triangles.push_back(
        {offset + random.float_vector(3), offset + random.float_vector(3), offset + random.float_vector(3), i});
  Instance instance;
  instance.mesh = mesh_of(triangles);
  const auto scale = static_cast<float>(random.magnitude(-30, 10));
  instance.transform = make_transform(random.vector(random.pick(kFarPlaces)), random.rotation(), scale);
  instance.bounds = bounds_to_world(instance.transform, instance.mesh->bounds());
  return instance;
}

double magnitude_of(const Instance& instance) {
  return max_component(abs(instance.transform.translation)) +
         4.0 * instance.transform.scale * magnitude(instance.mesh->bounds());
}

template <class Check>
void for_each_triangle(const Check& check) {
  for (uint64_t seed = 0; seed < 500; ++seed) {
    Random random(seed);
    const Instance instance = random_instance(random);
    const PlacedTriangles placed(instance);
    instance.mesh->tree().for_each([&](const Triangle& triangle) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " triangle " << triangle.number);
      check(instance, placed, triangle);
    });
  }
}

Aabb<Real> bounds_in_long_double(const Instance& instance, const Triangle& triangle) {
  const Transform& transform = instance.transform;
  Aabb<Real> bounds;
  for (const Vec3f corner : {triangle.a, triangle.b, triangle.c})
    bounds = merge(
        bounds, to_real(transform.translation) + turned(transform.quaternion, to_real(corner)) * Real{transform.scale});
  return bounds;
}

TEST(PlacedTriangleTest, BoundsContainTheTriangleAndAreGrownByRoundingOnly) {
  for_each_triangle([](const Instance& instance, const PlacedTriangles& placed, const Triangle& triangle) {
    const Aabb<Real> inner = bounds_in_long_double(instance, triangle);
    const Aabbd bounds = placed.bounds_of_triangle(triangle);
    const Aabb<Real> got{to_real(bounds.min), to_real(bounds.max)};
    EXPECT_TRUE(contains(got, inner));
    EXPECT_TRUE(contains(grown(inner, 0x1p-40L * magnitude_of(instance)), got));
  });
}

// The bounds of a placed triangle are within the instance's bounds. Therefore a search that culls by the instance's
// bounds, or by the distance to the instance's bounds, never misses a triangle whose own bounds meet the query.
TEST(PlacedTriangleTest, BoundsLieWithinTheInstanceBounds) {
  for_each_triangle([](const Instance& instance, const PlacedTriangles& placed, const Triangle& triangle) {
    EXPECT_TRUE(contains(instance.bounds, placed.bounds_of_triangle(triangle)));
  });
}

TEST(PlacedTriangleTest, BoundsLieWithinTheBoundsOfEveryBoxAroundTheTriangle) {
  for_each_triangle([](const Instance& /*instance*/, const PlacedTriangles& placed, const Triangle& triangle) {
    EXPECT_TRUE(contains(placed.bounds_of_box(bounds_of(triangle)), placed.bounds_of_triangle(triangle)));
  });
}

}  // namespace
}  // namespace locus::test
