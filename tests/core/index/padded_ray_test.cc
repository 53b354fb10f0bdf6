#include "core/index/padded_ray.h"

#include <gtest/gtest.h>

#include "core/geometry/ray_triangle.h"
#include "tests/support/random.h"

namespace locus::test {
namespace {

TEST(PaddedRayTest, TheUnitVectorIsThatOfDirectionsOfAnyLength) {
  for (const double length : {1e-30, 1.0, 1e30}) {
    const PaddedRay ray(SlabRay<double>({{1, 2, 3}, {0, 3 * length, 4 * length}}, kObjectPad), 10.0);
    EXPECT_NEAR(ray.unit().y, 0.6, 1e-15);
    EXPECT_NEAR(ray.unit().z, 0.8, 1e-15);
    EXPECT_NEAR(ray.reach(2), 10 * length, 1e-12 * length);
  }
}

TEST(PaddedRayTest, TheReachIsNeverBehindTheStart) {
  const PaddedRay ray(SlabRay<double>({{}, {1, 0, 0}}, kObjectPad), 1.0);
  EXPECT_EQ(ray.reach(-5), 0);
  EXPECT_EQ(ray.reach(std::numeric_limits<double>::infinity()), std::numeric_limits<double>::infinity());
}

// Compares in double: at the near and far values of a box that the slab test accepts, the ray is within the pad.
template <class S>
void expect_within_pad(uint64_t seed) {
  Random random(seed);
  int accepted = 0;
  for (int i = 0; i < 200'000; ++i) {
    const double size = random.magnitude(-10, 10);
    const auto scalars = [](const Vec3d& v) {
      return Vec3<S>{static_cast<S>(v.x), static_cast<S>(v.y), static_cast<S>(v.z)};
    };
    const Vec3<S> a = scalars(random.vector(size)), b = scalars(random.vector(size));
    const Aabb<S> box = {min(a, b), max(a, b)};
    const Vec3d corner = {random.chance(0.5) ? box.min.x : box.max.x, random.chance(0.5) ? box.min.y : box.max.y,
                          box.min.z};
    Vec3d direction = random.unit_vector();
    if (random.chance(0.3)) direction[static_cast<int>(random.below(3))] = 0;
    if (direction == Vec3d{}) continue;
    const Ray<S> line = {scalars(corner - direction * (size * random.unit())), scalars(direction)};
    const SlabRay<S> slabs(line, std::is_same_v<S, float> ? kTrianglePad : kObjectPad);
    const Interval<S> interval = slabs.interval(box);
    if (!(interval.near <= interval.far) || interval.far < 0) continue;
    ++accepted;
    const PaddedRay ray(slabs, magnitude(box));
    for (const S t : {std::max(interval.near, S{0}), interval.far}) {
      const Vec3d point =
          ray.origin() + ray.unit() * (double{t} * std::sqrt(squared_length(to_double(line.direction))));
      ASSERT_LE(std::sqrt(squared_distance(point, to_double(box))), ray.pad()) << "turn " << i;
      ASSERT_LE(double{t} * std::sqrt(squared_length(to_double(line.direction))), ray.reach(t) + ray.pad());
    }
  }
  EXPECT_GT(accepted, 50'000);
}

TEST(PaddedRayTest, AcceptedBoxesAreWithinThePadInFloat) { expect_within_pad<float>(1); }
TEST(PaddedRayTest, AcceptedBoxesAreWithinThePadInDouble) { expect_within_pad<double>(2); }

}  // namespace
}  // namespace locus::test
