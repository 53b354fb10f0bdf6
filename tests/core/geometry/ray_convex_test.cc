#include "core/geometry/ray_convex.h"

#include <cstdint>
#include <vector>

#include "core/geometry/shape.h"
#include "gtest/gtest.h"
#include "tests/support/random.h"
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
  // The line through (5, 0) and (0, 20 / 3) is at distance 4 from the origin, since this line and the axes form a
  // triangle with sides in the ratio 3 : 4 : 5.
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
  // For this tangent, rounding errors would decide the sign of the discriminant b^2 - 4ac, since its two terms are
  // larger than 1e18 and nearly equal.
  const Shape ball = ball_at({0, 0, 0}, 1);
  EXPECT_TRUE(ray_hit(test::ray_from({-1e9, 1, 0}, {1, 0, 0}), ball).has_value());
  EXPECT_FALSE(ray_hit(test::ray_from({-1e9, 1 + 1e-12, 0}, {1, 0, 0}), ball).has_value());
}

TEST(RayBallTest, LineInBallOfAZeroDirectionIsInfiniteOrEmpty) {
  EXPECT_TRUE(line_in_ball({{3, 4, 0}, {}}, 25).has_value());
  EXPECT_FALSE(line_in_ball({{3, 4, 0.1}, {}}, 25).has_value());
}

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

Shape box_of(Vec3d center, Vec3f half, Quaternion rotation = {}) {
  return {ShapeKind::kBox, center, rotation, half, 0};
}

std::vector<Vec3d> signs_of_each_axis() {
  std::vector<Vec3d> signs;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0) signs.push_back({double(x), double(y), double(z)});
  return signs;
}

struct Rational {  // denominator > 0
  int64_t numerator, denominator;
  friend bool operator<(Rational a, Rational b) { return a.numerator * b.denominator < b.numerator * a.denominator; }
};

// Returns whether a ray hits a box around the origin, by a slab test in integer arithmetic, without rounding.
bool exact_hit(const int64_t (&o)[3], const int64_t (&d)[3], const int64_t (&half)[3]) {
  Rational near{-1000000, 1}, far{1000000, 1};
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0) {
      if (std::abs(o[axis]) > half[axis]) return false;
      continue;
    }
    const int64_t sign = d[axis] < 0 ? -1 : 1;
    const Rational entry{-half[axis] - sign * o[axis], sign * d[axis]};
    const Rational exit{half[axis] - sign * o[axis], sign * d[axis]};
    near = std::max(near, entry);
    far = std::min(far, exit);
  }
  return !(far < near) && far.numerator >= 0;
}

TEST(RayObbTest, CornersAndEdgesAreTouchedFromAll26Directions) {
  const Vec3f half = {1, 2, 3};
  const Shape box = box_of({5, -7, 11}, half);
  for (const Vec3d place : signs_of_each_axis()) {  // a corner, or the middle of an edge or face
    const Vec3d target = box.position + Vec3d{place.x * half.x, place.y * half.y, place.z * half.z};
    for (const Vec3d direction : signs_of_each_axis()) {
      const auto hit = ray_hit(test::ray_from(target - direction * 8.0, direction), box);
      ASSERT_TRUE(hit.has_value());
      EXPECT_GE(hit->t, 0);
      EXPECT_LE(hit->t, 8);
      EXPECT_TRUE(ray_hit(test::ray_from(target, direction), box).has_value());
    }
  }
}

TEST(RayObbTest, VerdictsOnIntegerRaysAreExact) {
  constexpr uint64_t kSeed = 11;
  test::Random random(kSeed);
  int hits = 0;
  for (int i = 0; i < 200000; ++i) {
    int64_t o[3], d[3], half[3];
    for (int axis = 0; axis < 3; ++axis) {
      o[axis] = random.whole(-12, 12);
      d[axis] = random.whole(-7, 7);
      half[axis] = random.whole(0, 4);
    }
    if (d[0] == 0 && d[1] == 0 && d[2] == 0) continue;
    const Vec3d origin = {double(o[0]), double(o[1]), double(o[2])};
    const Vec3d direction = {double(d[0]), double(d[1]), double(d[2])};
    const Shape box = box_of({0, 0, 0}, {float(half[0]), float(half[1]), float(half[2])});
    const bool expected = exact_hit(o, d, half);
    hits += expected;
    ASSERT_EQ(ray_hit(test::ray_from(origin, direction), box).has_value(), expected)
        << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(hits, 5000);
}

TEST(RayObbTest, ARayInAFacePlaneTouchesAndOneBesideItDoesNot) {
  const Shape box = box_of({0, 0, 0}, {1, 1, 1});
  const auto hit = ray_hit(test::ray_from({-4, 1, 0}, {1, 0, 0}), box);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->t, 3);
  EXPECT_EQ(hit->normal, (Vec3d{-1, 0, 0}));
  EXPECT_TRUE(ray_hit(test::ray_from({-4, 1, 1}, {1, 0, 0}), box).has_value());
  EXPECT_FALSE(ray_hit(test::ray_from({-4, std::nextafter(1.0, 2.0), 0}, {1, 0, 0}), box).has_value());
}

TEST(RayObbTest, EachInsideModeHasItsAnswerFromInside) {
  const Shape box = box_of({0, 0, 0}, {1, 2, 3});
  const Rayd ray = {{0, 1, 0}, {0, -2, 0}};
  const auto solid = ray_hit(ObjectRay(ray), box);
  EXPECT_EQ(solid->t, 0);
  EXPECT_EQ(solid->normal, (Vec3d{0, 1, 0}));
  const auto hollow = ray_hit(ObjectRay(ray, Inside::kHollow), box);
  EXPECT_EQ(hollow->t, 1.5);
  EXPECT_EQ(hollow->normal, (Vec3d{0, -1, 0}));
  EXPECT_FALSE(ray_hit(ObjectRay(ray, Inside::kSkip), box).has_value());
}

TEST(RayObbTest, ARotatedBoxIsHitOnItsRotatedFace) {
  const float sin_45 = std::sqrt(0.5f);  // for the quaternion of a rotation by 90 degrees around z
  const Shape box = box_of({10, 0, 0}, {1, 2, 3}, {0, 0, sin_45, sin_45});
  const auto hit = ray_hit(test::ray_from({0, 0, 0}, {1, 0, 0}), box);
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->t, 8, 1e-14);
  EXPECT_NEAR(hit->normal.x, -1, 1e-15);
}

TEST(RayObbTest, FlatAndZeroSizeBoxesAreHit) {
  EXPECT_EQ(ray_hit(test::ray_from({0, 0, 0}, {1, 1, 0}), box_of({4, 4, 0}, {0, 1, 1}))->t, 4);
  const auto hit = ray_hit(test::ray_from({0, 0, 0}, {1, 2, 3}), box_of({2, 4, 6}, {0, 0, 0}));
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->t, 2);
  EXPECT_FALSE(ray_hit(test::ray_from({0, 0, 0}, {1, 2, 2.999}), box_of({2, 4, 6}, {0, 0, 0})).has_value());
}

}  // namespace
}  // namespace locus
