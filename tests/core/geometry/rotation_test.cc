#include "core/geometry/rotation.h"

#include "gtest/gtest.h"
#include "tests/support/random.h"
#include "tests/support/real.h"

namespace locus {
namespace {

using test::Random;

double distance(Vec3d a, Vec3d b) { return std::sqrt(squared_length(a - b)); }

TEST(RotationTest, AgreesWithTheQuaternionProduct) {
  constexpr uint64_t kSeed = 91;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Quaternion q = random.rotation();
    const Vec3d v = random.vector(1);
    const test::Vec3r expected = test::turned(q, test::to_real(v));
    const test::Vec3r actual = test::to_real(rotation_of(q).to_world(v));
    ASSERT_LT(test::length(expected - actual), 4e-16L * 4) << "seed " << kSeed << " case " << i;
  }
}

TEST(RotationTest, ToLocalInvertsToWorld) {
  constexpr uint64_t kSeed = 92;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Rotation r = rotation_of(random.rotation());
    const Vec3d v = random.vector(1);
    ASSERT_LT(distance(r.to_local(r.to_world(v)), v), 4e-15) << "seed " << kSeed << " case " << i;
    ASSERT_EQ(inverse(r).to_world(v), r.to_local(v)) << "seed " << kSeed << " case " << i;
  }
}

TEST(RotationTest, IdentityIsExact) {
  const Vec3d v = {0.1, -2e-300, 3e300};
  EXPECT_EQ(rotation_of(Quaternion{}), Rotation{});
  EXPECT_EQ(rotation_of(Quaternion{}).to_world(v), v);
  EXPECT_EQ(rotation_of({0, 0, 0, -1}).to_local(v), v);
}

TEST(RotationTest, HalfTurnsAreExact) {
  EXPECT_EQ(rotation_of({0, 0, 1, 0}).to_world({1, 2, 3}), (Vec3d{-1, -2, 3}));
  EXPECT_EQ(rotation_of({1, 0, 0, 0}).to_world({1, 2, 3}), (Vec3d{1, -2, -3}));
}

TEST(RotationTest, QuarterTurnAroundZTakesXToY) {
  const float s = std::sqrt(0.5f);
  EXPECT_LT(distance(rotation_of({0, 0, s, s}).to_world({1, 0, 0}), Vec3d{0, 1, 0}), 1e-15);
}

TEST(RotationTest, ComposeRotatesByTheFirstThenTheSecond) {
  constexpr uint64_t kSeed = 93;
  Random random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Rotation first = rotation_of(random.rotation()), second = rotation_of(random.rotation());
    const Vec3d v = random.vector(1);
    ASSERT_LT(distance(compose(second, first).to_world(v), second.to_world(first.to_world(v))), 1e-14)
        << "seed " << kSeed << " case " << i;
  }
}

TEST(RotationTest, ExtentsEqualTheFarthestCorner) {
  constexpr uint64_t kSeed = 94;
  Random random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Rotation r = rotation_of(random.rotation());
    const Vec3d half = random.positive_vector(1);
    Vec3d world, local;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3d c = {corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y, corner & 4 ? half.z : -half.z};
      world = max(world, abs(r.to_world(c)));
      local = max(local, abs(r.to_local(c)));
    }
    ASSERT_LT(distance(r.extent_to_world(half), world), 1e-15) << "seed " << kSeed << " case " << i;
    ASSERT_LT(distance(r.extent_to_local(half), local), 1e-15) << "seed " << kSeed << " case " << i;
  }
}

TEST(RotationTest, NormalizedHasUnitLength) {
  EXPECT_EQ(unit_deviation({0, 0, 0, 1}), 0);
  EXPECT_NEAR(unit_deviation({0, 0, 0, 1.001f}), 1e-3, 1e-7);
  EXPECT_NEAR(unit_deviation({0, 0, 0, 0}), 1, 0);
  const Quaternion q = normalized(Quaternion{0.2f, 0.4f, 0.4f, 0.801f});
  EXPECT_LT(unit_deviation(q), 1e-7);
}

TEST(RotationTest, BlendedTakesTheShorterArcAtUnitLength) {
  constexpr uint64_t kSeed = 95;
  Random random(kSeed);
  for (int i = 0; i < 1000; ++i) {
    const Quaternion a = random.rotation(), b = random.rotation();
    const double weight = random.unit();
    const Quaternion between = blended(a, b, weight);
    const Quaternion with_opposite_sign = blended(a, {-b.x, -b.y, -b.z, -b.w}, weight);
    ASSERT_LT(unit_deviation(between), 1e-6) << "seed " << kSeed << " case " << i;
    ASSERT_EQ(between, with_opposite_sign) << "seed " << kSeed << " case " << i;
  }
  const Quaternion half = blended({0, 0, 0, 1}, {0, 0, 1, 0}, 0.5);
  EXPECT_NEAR(half.z, half.w, 1e-7);
}

TEST(RotationTest, BlendingEqualQuaternionsKeepsTheirBits) {
  const Quaternion q{0.1f, 0.7f, 0.3f, 0.64031242f};
  EXPECT_EQ(blended(q, q, 0.3), q);
  EXPECT_EQ(blended(q, {0, 0, 0, 1}, 0), normalized(q));
}

}  // namespace
}  // namespace locus
