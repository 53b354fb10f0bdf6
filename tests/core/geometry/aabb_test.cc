#include "core/geometry/aabb.h"

#include "core/geometry/ball.h"
#include "gtest/gtest.h"
#include "tests/support/random.h"

namespace locus {
namespace {

constexpr Aabbd kUnit = {{0, 0, 0}, {1, 1, 1}};

Aabbd random_box(test::Random& random, double size) {
  const Vec3d a = random.vector(size), b = random.vector(size);
  return {min(a, b), max(a, b)};
}

TEST(AabbTest, TouchingFacesEdgesAndCornersOverlap) {
  for (double x = -1; x <= 1; ++x)
    for (double y = -1; y <= 1; ++y)
      for (double z = -1; z <= 1; ++z) {
        EXPECT_TRUE(overlaps(kUnit, {{x, y, z}, {x + 1, y + 1, z + 1}}));
        EXPECT_TRUE(overlaps({{x, y, z}, {x + 1, y + 1, z + 1}}, kUnit));
      }
}

TEST(AabbTest, AGapOnAnyAxisSeparates) {
  for (int axis = 0; axis < 3; ++axis) {
    Aabbd after = kUnit, before = kUnit;
    after.min[axis] = std::nextafter(1.0, 2.0);
    after.max[axis] = 2;
    before.min[axis] = -1;
    before.max[axis] = -0x1p-1074;
    EXPECT_FALSE(overlaps(kUnit, after));
    EXPECT_FALSE(overlaps(kUnit, before));
  }
}

TEST(AabbTest, AnEmptyBoxIsNeutralForMergeAndOverlapsNothing) {
  const Aabbd empty;
  EXPECT_TRUE(empty.empty());
  EXPECT_FALSE(kUnit.empty());
  EXPECT_FALSE((Aabbd{{1, 1, 1}, {1, 1, 1}}.empty()));
  EXPECT_EQ(merge(empty, kUnit), kUnit);
  EXPECT_EQ(merge(kUnit, empty), kUnit);
  EXPECT_FALSE(overlaps(empty, kUnit));
  EXPECT_EQ(half_area(empty), 0);
}

TEST(AabbTest, MergeIsTheSmallestBoxThatContainsBoth) {
  EXPECT_EQ(merge(kUnit, Vec3d{2, -1, 0.5}), (Aabbd{{0, -1, 0}, {2, 1, 1}}));
  EXPECT_TRUE(contains(merge(kUnit, Vec3d{2, -1, 0.5}), kUnit));
  EXPECT_TRUE(contains(kUnit, Vec3d{1, 1, 1}));
  EXPECT_FALSE(contains(kUnit, Vec3d{1, 1, 1.0000001}));
}

TEST(AabbTest, SquaredDistanceIsZeroInsideAndExactOutside) {
  EXPECT_EQ(squared_distance(Vec3d{0.5, 1, 0}, kUnit), 0);
  EXPECT_EQ(squared_distance(Vec3d{4, 5, 0.5}, kUnit), 25);
  EXPECT_EQ(squared_distance(Vec3d{-3, 0.5, -4}, kUnit), 25);
}

// A superset of a box is never farther from a point than the box, and its magnitude() is never smaller. So culling by
// any superset loses no result.
TEST(AabbTest, ASupersetIsNeverFartherNorSmaller) {
  constexpr uint64_t kSeed = 71;
  test::Random random(kSeed);
  for (int i = 0; i < 100000; ++i) {
    const Aabbd inner = random_box(random, random.magnitude(-20, 20));
    const Aabbd outer = merge(inner, random_box(random, random.magnitude(-20, 20)));
    const Vec3d point = random.vector(random.magnitude(-20, 20));
    ASSERT_LE(squared_distance(point, outer), squared_distance(point, inner)) << "seed " << kSeed << " case " << i;
    ASSERT_GE(magnitude(outer), magnitude(inner)) << "seed " << kSeed << " case " << i;
    const Balld ball{point, random.magnitude(-20, 20)};
    ASSERT_TRUE(!reaches(ball, inner) || reaches(ball, outer)) << "seed " << kSeed << " case " << i;
  }
}

TEST(BallTest, ABoxThatTheBallReachesOverlapsItsBounds) {
  constexpr uint64_t kSeed = 72;
  test::Random random(kSeed);
  int reached = 0;
  for (int i = 0; i < 100000; ++i) {
    const Ballf ball{random.float_vector(random.magnitude(-10, 20)), static_cast<float>(random.magnitude(-10, 10))};
    // The box is a single point on the surface of the ball, up to float rounding.
    Vec3d toward = random.unit_vector();
    if (random.chance(0.5)) toward = {random.chance(0.5) ? 1.0 : -1.0, 0, 0};
    const Vec3f point = to_float(to_double(ball.center) + toward * double{ball.radius});
    const Aabbf box = {point, point};
    if (!reaches(ball, box)) continue;
    ++reached;
    ASSERT_TRUE(overlaps(bounds_of(ball), box)) << "seed " << kSeed << " case " << i;
    ASSERT_TRUE(overlaps(bounds_of(Balld{to_double(ball.center), ball.radius}), to_double(box)))
        << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(reached, 10000);
}

}  // namespace
}  // namespace locus
