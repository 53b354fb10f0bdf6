#include "core/geometry/ray_capsule.h"

#include "core/geometry/shape.h"
#include "gtest/gtest.h"
#include "tests/support/random_shape.h"

namespace locus {
namespace {

Shape capsule_at(Vec3d center, Vec3f half_axis, float radius) {
  return {ShapeKind::kCapsule, center, {}, half_axis, radius};
}

TEST(RayCapsuleTest, SideAndEndsAreHitAtTheExactDistance) {
  const Shape capsule = capsule_at({0, 0, 0}, {0, 0, 4}, 1);
  const auto side = ray_hit(test::ray_from({-3, 0, 3}, {1, 0, 0}), capsule);
  EXPECT_EQ(side->t, 2);
  EXPECT_EQ(side->normal, (Vec3d{-1, 0, 0}));
  const auto end = ray_hit(test::ray_from({0, 0, 9}, {0, 0, -1}), capsule);
  EXPECT_EQ(end->t, 4);
  EXPECT_EQ(end->normal, (Vec3d{0, 0, 1}));
  EXPECT_EQ(ray_hit(test::ray_from({0, 0, 0}, {0, 0, 1}, Inside::kHollow), capsule)->t, 5);
}

TEST(RayCapsuleTest, TangentsOfSideAndEndTouch) {
  const Shape capsule = capsule_at({0, 0, 0}, {0, 0, 4}, 1);
  EXPECT_TRUE(ray_hit(test::ray_from({-3, 1, 2}, {1, 0, 0}), capsule).has_value());
  EXPECT_TRUE(ray_hit(test::ray_from({-3, 0, 5}, {1, 0, 0}), capsule).has_value());
  EXPECT_TRUE(ray_hit(test::ray_from({1, 0, -9}, {0, 0, 1}), capsule).has_value());
  const double beside = std::nextafter(1.0, 2.0);
  EXPECT_FALSE(ray_hit(test::ray_from({-3, beside, 2}, {1, 0, 0}), capsule).has_value());
  EXPECT_FALSE(ray_hit(test::ray_from({beside, 0, -9}, {0, 0, 1}), capsule).has_value());
}

TEST(RayCapsuleTest, ZeroHalfAxisIsABallToTheLastBit) {
  constexpr uint64_t kSeed = 21;
  test::Random random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Shape ball = test::random_shape(random, ShapeKind::kBall, 100);
    Shape capsule = ball;
    capsule.kind = ShapeKind::kCapsule;
    capsule.size = {};
    capsule.rotation = {};
    const ObjectRay ray(test::random_ray(random, ball, ball.radius + 0.01));
    const auto a = ray_hit(ray, ball), b = ray_hit(ray, capsule);
    ASSERT_EQ(a.has_value(), b.has_value()) << "seed " << kSeed << " case " << i;
    if (!a) continue;
    ASSERT_EQ(a->t, b->t) << "seed " << kSeed << " case " << i;
  }
}

TEST(RayCapsuleTest, ZeroRadiusIsASegment) {
  const Shape segment = capsule_at({0, 0, 0}, {0, 0, 2}, 0);
  EXPECT_EQ(ray_hit(test::ray_from({-4, 0, 2}, {1, 0, 0}), segment)->t, 4);
  EXPECT_EQ(ray_hit(test::ray_from({0, 0, -8}, {0, 0, 2}), segment)->t, 3);
  EXPECT_EQ(ray_hit(test::ray_from({0, 0, -8}, {0, 0, 2}), segment)->normal, (Vec3d{0, 0, -1}));
  EXPECT_FALSE(ray_hit(test::ray_from({-4, 0, 2.001}, {1, 0, 0}), segment).has_value());
}

TEST(RayCapsuleTest, ContainsItsSurface) {
  EXPECT_TRUE(capsule_contains({0, 0, 4}, 5, {3, 4, 1}));
  EXPECT_TRUE(capsule_contains({0, 0, 4}, 5, {0, 3, 8}));
  EXPECT_FALSE(capsule_contains({0, 0, 4}, 5, {3, 4.000001, 1}));
}

}  // namespace
}  // namespace locus
