// Tests of the slab test. The ray's interval in a box contains the t of every point of the ray in the box. The ray's
// interval in a superset of the box contains the ray's interval in the box.
#include "core/geometry/ray.h"

#include "gtest/gtest.h"
#include "tests/support/random.h"
#include "tests/support/real.h"

namespace locus {
namespace {

using test::Random;

template <class S>
Vec3<S> cast(Vec3d v) {
  return {static_cast<S>(v.x), static_cast<S>(v.y), static_cast<S>(v.z)};
}

// Random ray and box. Many are degenerate: flat boxes, directions along axes, origins on the planes of the box.
template <class S>
struct SlabCase {
  Ray<S> ray;
  Aabb<S> box;

  explicit SlabCase(Random& random) {
    const double size = random.magnitude(-10, 20);
    const Vec3<S> a = cast<S>(random.vector(size)), b = cast<S>(random.vector(size));
    box = {min(a, b), max(a, b)};
    const int flat = static_cast<int>(random.below(6));
    if (flat < 3) box.max[flat] = box.min[flat];
    ray.origin = cast<S>(random.vector(size * random.magnitude(-1, 6)));
    if (random.chance(0.3)) {
      const int axis = static_cast<int>(random.below(3));
      ray.origin[axis] = random.chance(0.5) ? box.min[axis] : box.max[axis];
    }
    ray.direction = cast<S>(random.unit_vector() * random.magnitude(-3, 3));
    for (int axis = 0; axis < 3; ++axis) {
      if (random.chance(0.2)) ray.direction[axis] = random.chance(0.5) ? S{0} : -S{0};
      if (random.chance(0.05)) ray.direction[axis] = static_cast<S>(1e-30);
    }
    if (max_component(abs(ray.direction)) < S(1e-3)) ray.direction.x = S{1};
  }
};

template <class S>
class SlabRayTest : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(SlabRayTest, Scalars);

template <class S>
constexpr double pad() {
  return std::is_same_v<S, float> ? kTrianglePad : kObjectPad;
}

TYPED_TEST(SlabRayTest, ASupersetHasNoLargerNearAndNoSmallerFar) {
  using S = TypeParam;
  constexpr uint64_t kSeed = 81;
  Random random(kSeed);
  for (int i = 0; i < 200000; ++i) {
    const SlabCase<S> c(random);
    const SlabRay<S> slabs(c.ray, pad<S>());
    Aabb<S> outer = c.box;
    const int kind = static_cast<int>(random.below(3));
    if (kind == 0) outer = merge(outer, cast<S>(random.vector(random.magnitude(-10, 25))));
    if (kind == 1) outer.min.x = std::nextafter(outer.min.x, -Aabb<S>::kInfinity);
    if (kind == 2) outer.max.y = std::nextafter(outer.max.y, Aabb<S>::kInfinity);
    const Interval<S> a = slabs.interval(c.box), b = slabs.interval(outer);
    ASSERT_LE(b.near, a.near) << "seed " << kSeed << " case " << i;
    ASSERT_GE(b.far, a.far) << "seed " << kSeed << " case " << i;
    const Interval<S> larger = slabs.interval(c.box, magnitude(outer));
    ASSERT_LE(larger.near, a.near) << "seed " << kSeed << " case " << i;
    ASSERT_GE(larger.far, a.far) << "seed " << kSeed << " case " << i;
  }
}

TYPED_TEST(SlabRayTest, PointsOfTheRayInTheBoxLieInTheInterval) {
  using S = TypeParam;
  constexpr uint64_t kSeed = 82;
  Random random(kSeed);
  for (int i = 0; i < 200000; ++i) {
    SlabCase<S> c(random);
    // Makes a box that contains a point of the ray after the point is rounded to S; the pad must cover the error of
    // this rounding.
    const auto t =
        static_cast<test::Real>(random.between(0, 1)) * (magnitude(c.box) + max_component(abs(c.ray.origin)));
    const test::Vec3r point = test::to_real(c.ray.origin) + test::to_real(c.ray.direction) * t;
    const Vec3<S> corner = {static_cast<S>(point.x), static_cast<S>(point.y), static_cast<S>(point.z)};
    const Aabb<S> box = random.chance(0.5) ? merge(c.box, corner) : Aabb<S>{corner, corner};
    const Interval<S> interval = SlabRay<S>(c.ray, pad<S>()).interval(box);
    ASSERT_LE(interval.near, static_cast<S>(t)) << "seed " << kSeed << " case " << i;
    ASSERT_GE(interval.far, static_cast<S>(t)) << "seed " << kSeed << " case " << i;
  }
}

TYPED_TEST(SlabRayTest, BoxesClearlyBesideTheRayAreMissed) {
  using S = TypeParam;
  const Ray<S> ray = {{0, 0, 0}, {1, 0, 0}};
  const SlabRay<S> slabs(ray, pad<S>());
  const Interval<S> beside = slabs.interval({{1, 1, -1}, {2, 2, 1}});
  EXPECT_GT(beside.near, beside.far);
  const Interval<S> on = slabs.interval({{1, 0, -1}, {2, 2, 1}});
  EXPECT_LE(on.near, on.far);
  EXPECT_NEAR(on.near, 1, 1e-5);
  EXPECT_NEAR(on.far, 2, 1e-5);
  const Interval<S> behind = slabs.interval({{-2, -1, -1}, {-1, 1, 1}});
  EXPECT_LT(behind.far, 0);
}

TYPED_TEST(SlabRayTest, ZeroDirectionComponentsGiveNoNan) {
  using S = TypeParam;
  for (const S zero : {S{0}, -S{0}}) {
    const Ray<S> ray = {{1, 1, 1}, {zero, S{1}, zero}};
    const Interval<S> interval = SlabRay<S>(ray, pad<S>()).interval({{1, 1, 1}, {1, 5, 1}});
    EXPECT_LE(interval.near, 0);
    EXPECT_GE(interval.far, 4);
  }
}

}  // namespace
}  // namespace locus
