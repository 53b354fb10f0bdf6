#include "core/geometry/ray_ball.h"

#include "core/geometry/shape.h"
#include "gtest/gtest.h"
#include "tests/support/random_shape.h"

namespace locus {
namespace {

Shape ball_at(Vec3d center, float radius) { return {ShapeKind::kBall, center, {}, {}, radius}; }

TEST(RayBallTest, ATangentTouchesAndTheNextLineOutsideDoesNot) {
  const Shape ball = ball_at({10, 0, 0}, 5);
  const auto hit = ray_hit(test::ray_from({0, 5, 0}, {1, 0, 0}), ball);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->t, 10);
  EXPECT_EQ(hit->normal, (Vec3d{0, 1, 0}));
  EXPECT_FALSE(ray_hit(test::ray_from({0, std::nextafter(5.0, 6.0), 0}, {1, 0, 0}), ball).has_value());
}

TEST(RayBallTest, AnObliqueTangentOfA345TriangleTouches) {
  // The line through (5, 0) and (0, 20 / 3) * 3 is at distance 4 from the origin: 3-4-5 scaled.
  const auto hit = ray_hit(test::ray_from({5, 0, 0}, {-3, 4, 0}), ball_at({0, 0, 0}, 4));
  ASSERT_TRUE(hit.has_value());
  EXPECT_DOUBLE_EQ(hit->t, 0.6);
}

TEST(RayBallTest, ARayEntersInFrontAndLeavesBehind) {
  const Shape ball = ball_at({10, 0, 0}, 2);
  EXPECT_EQ(ray_hit(test::ray_from({0, 0, 0}, {2, 0, 0}), ball)->t, 4);
  const auto out = ray_hit(test::ray_from({10, 0, 0}, {2, 0, 0}, Inside::kHollow), ball);
  EXPECT_EQ(out->t, 1);
  EXPECT_EQ(out->normal, (Vec3d{1, 0, 0}));
  EXPECT_FALSE(ray_hit(test::ray_from({0, 0, 0}, {-1, 0, 0}), ball).has_value());
}

TEST(RayBallTest, AnOriginOnTheSurfaceIsInside) {
  const Shape ball = ball_at({0, 0, 0}, 5);
  for (const Vec3d direction : {Vec3d{1, 0, 0}, Vec3d{-1, 0, 0}, Vec3d{-4, 3, 0}}) {
    const auto hit = ray_hit(test::ray_from({3, 4, 0}, direction), ball);
    ASSERT_TRUE(hit.has_value());
    EXPECT_EQ(hit->t, 0);
    EXPECT_EQ(hit->normal, -normalized(direction));
    EXPECT_FALSE(ray_hit(test::ray_from({3, 4, 0}, direction, Inside::kSkip), ball).has_value());
  }
  EXPECT_EQ(ray_hit(test::ray_from({3, 4, 0}, {3, 4, 0}, Inside::kHollow), ball)->t, 0);
  EXPECT_EQ(ray_hit(test::ray_from({3, 4, 0}, {-3, -4, 0}, Inside::kHollow), ball)->t, 2);
}

TEST(RayBallTest, ABallOfRadiusZeroIsHitOnlyThroughItsCentre) {
  const Shape speck = ball_at({2, 4, 6}, 0);
  const auto hit = ray_hit(test::ray_from({0, 0, 0}, {1, 2, 3}), speck);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->t, 2);
  EXPECT_EQ(hit->normal, -normalized(Vec3d{1, 2, 3}));
  EXPECT_FALSE(ray_hit(test::ray_from({0, 0, 0}, {1, 2, 3.0000001}), speck).has_value());
}

TEST(RayBallTest, AFarOriginCausesNoCancellation) {
  // With b^2 - 4ac rounding would decide this tangent: both terms are about 1e18 and differ by 1.
  const Shape ball = ball_at({0, 0, 0}, 1);
  EXPECT_TRUE(ray_hit(test::ray_from({-1e9, 1, 0}, {1, 0, 0}), ball).has_value());
  EXPECT_FALSE(ray_hit(test::ray_from({-1e9, 1 + 1e-12, 0}, {1, 0, 0}), ball).has_value());
}

TEST(RayBallTest, LineInBallOfAZeroDirectionIsInfiniteOrEmpty) {
  EXPECT_TRUE(line_in_ball({{3, 4, 0}, {}}, 25).has_value());
  EXPECT_FALSE(line_in_ball({{3, 4, 0.1}, {}}, 25).has_value());
}

}  // namespace
}  // namespace locus
